// ClamorListener.cs: a listener in a level, whose sound the audio thread renders.
using System;
using System.Runtime.InteropServices;

namespace Clamor
{
    // A voice of a keyframe, for mixers of the application's own: clamor_voice in clamor.h.
    public struct Voice
    {
        public int Slot;
        public bool Starts;
        public int LevelSound;  // the number of the level's sound, or -1: one of the application's
        public float X, Y, Z;   // direction to the source: right, up, behind the listener
        public double DelayS;
        public float Gain63Hz, Gain125Hz, Gain250Hz, Gain500Hz, Gain1kHz, Gain2kHz, Gain4kHz, Gain8kHz;
    }

    public sealed class Listener : ContextObject
    {
        private Native.clamor_voice[] read = new Native.clamor_voice[0];

        internal Listener(Context context, ulong handle) : base(context, handle) =>
            Channels = (int)Native.GetChannels(context.Handle, handle);

        // Waits until the audio thread has left the listener, so Dispose() is not for the audio thread.
        internal override int GiveBack() => Native.clamor_destroy_listener(Context.Handle, Handle);

        public int Channels { get; private set; }

        public void Move(Pose pose) => Native.MoveListener(Context.Handle, Handle, pose);

        // Crossfades to another level within a tenth of a second.
        public void Enter(Level level) => Native.EnterLevel(Context.Handle, Handle, level.Handle);

        // Offline: true if a keyframe is wanted: move the listener to its pose at `timeS` seconds and
        // call Context.Update().
        public bool WantsKeyframe(out double timeS)
        {
            Native.NextKeyframe(Context.Handle, Handle, out uint wanted, out timeS);
            return wanted != 0;
        }

        public ListenerStatistics Statistics
        {
            get {
                var found = Native.GetListenerStatistics(Context.Handle, Handle);
                return new ListenerStatistics {
                    Voices = (int)found.voices, Keyframes = found.keyframes,
                    HeldBlocks = found.held_blocks, KeyframeMs = found.keyframe_ms,
                    Pages = found.pages, PageBytes = found.page_bytes,
                    SoundBytes = found.sound_bytes, Failures = found.failures,
                    UnseenSources = (int)found.unseen_sources };
            }
        }

        // Reads voices of the newest keyframe, as many as there is room for, and returns how many there
        // are. Only with ListenerOptions.ReportsVoices.
        public int GetVoices(Voice[] into, out double timeS)
        {
            if (read.Length < into.Length) read = new Native.clamor_voice[into.Length];
            GCHandle pinned = GCHandle.Alloc(read, GCHandleType.Pinned);
            var voices = new Native.clamor_voices {
                capacity = (uint)into.Length, voices = pinned.AddrOfPinnedObject() };
            try {
                Native.GetVoices(Context.Handle, Handle, ref voices);
            } finally {
                pinned.Free();
            }
            timeS = voices.time_s;
            for (int i = 0; i < Math.Min(into.Length, (int)voices.count); ++i) {
                Native.clamor_voice v = read[i];
                Floats8 gains = v.band_gains;
                into[i] = new Voice {
                    Slot = (int)v.slot, Starts = v.starts != 0, LevelSound = v.sound != 0 ? -1 : (int)v.level_sound,
                    X = v.direction._0, Y = v.direction._1, Z = v.direction._2, DelayS = v.delay_s,
                    Gain63Hz = gains._0, Gain125Hz = gains._1, Gain250Hz = gains._2, Gain500Hz = gains._3,
                    Gain1kHz = gains._4, Gain2kHz = gains._5, Gain4kHz = gains._6, Gain8kHz = gains._7 };
            }
            return (int)voices.count;
        }

        // Audio thread: overwrites `frames` frames of all channels, interleaved, from
        // samples[offset] on, and returns 0 or an error of clamor.h, after which they are as they
        // were. Allocates nothing and never throws; safe against Dispose() on another thread.
        public int Render(float[] samples, int offset, int frames)
        {
            if (samples == null || offset < 0 || frames < 0 || offset > samples.Length ||
                frames > (samples.Length - offset) / Channels)
                return Native.CLAMOR_ERROR_ARGUMENT;
            if (frames == 0) return Native.CLAMOR_OK;
            if (!Context.Handle.TryHold()) return Native.CLAMOR_ERROR_STATE;
            int code = Native.clamor_render(Context.Handle.DangerousGetHandle(), Handle,
                ref samples[offset], (uint)frames);
            Context.Handle.DangerousRelease();
            return code;
        }
    }
}

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

    public sealed class Listener : IDisposable
    {
        private readonly Context context;
        private ulong handle;
        private readonly int channels;
        private Native.clamor_voice[] read = new Native.clamor_voice[0];

        internal Listener(Context context, ulong handle)
        {
            this.context = context;
            this.handle = handle;
            uint found;
            ClamorException.Check(Native.clamor_get_channels(context.Handle, handle, out found));
            channels = (int)found;
        }

        // Waits until the audio thread has left the listener. Not on the audio thread.
        public void Dispose()
        {
            if (handle != 0 && !context.Handle.IsClosed)
                Native.clamor_destroy_listener(context.Handle, handle);
            handle = 0;
        }

        public int Channels
        {
            get { return channels; }
        }

        public void Move(Pose pose)
        {
            Native.clamor_pose moved = pose.ToNative();
            ClamorException.Check(Native.clamor_move_listener(context.Handle, handle, ref moved));
        }

        // Crossfades to another level within a tenth of a second.
        public void Enter(Level level)
        {
            var error = new byte[Native.ErrorBytes];
            ClamorException.Check(
                Native.clamor_enter_level(context.Handle, handle, level.Handle, error), error);
        }

        // Offline: true if a keyframe is wanted: move the listener to its pose at `timeS` seconds and
        // call Context.Update().
        public bool WantsKeyframe(out double timeS)
        {
            uint wanted;
            ClamorException.Check(
                Native.clamor_next_keyframe(context.Handle, handle, out wanted, out timeS));
            return wanted != 0;
        }

        public ListenerStatistics Statistics
        {
            get {
                var found = new Native.clamor_listener_statistics {
                    bytes = Native.clamor_listener_statistics.Size };
                ClamorException.Check(
                    Native.clamor_get_listener_statistics(context.Handle, handle, ref found));
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
            Native.clamor_voices voices = new Native.clamor_voices {
                bytes = Native.clamor_voices.Size, capacity = (uint)into.Length,
                voices = pinned.AddrOfPinnedObject() };
            try {
                ClamorException.Check(Native.clamor_get_voices(context.Handle, handle, ref voices));
            } finally {
                pinned.Free();
            }
            timeS = voices.time_s;
            for (int i = 0; i < Math.Min(into.Length, (int)voices.count); ++i) {
                Native.clamor_voice v = read[i];
                into[i] = new Voice {
                    Slot = (int)v.slot, Starts = v.starts != 0, LevelSound = v.sound != 0 ? -1 : (int)v.level_sound,
                    X = v.direction_0, Y = v.direction_1, Z = v.direction_2, DelayS = v.delay_s,
                    Gain63Hz = v.band_gains_0, Gain125Hz = v.band_gains_1, Gain250Hz = v.band_gains_2,
                    Gain500Hz = v.band_gains_3, Gain1kHz = v.band_gains_4, Gain2kHz = v.band_gains_5,
                    Gain4kHz = v.band_gains_6, Gain8kHz = v.band_gains_7 };
            }
            return (int)voices.count;
        }

        // Audio thread: overwrites `frames` frames of all channels, interleaved, from
        // samples[offset] on, and returns 0 or an error of clamor.h, after which they are as they
        // were. Allocates nothing and never throws; safe against Dispose() on another thread.
        public int Render(float[] samples, int offset, int frames)
        {
            if (samples == null || offset < 0 || frames < 0 || offset > samples.Length ||
                frames > (samples.Length - offset) / channels)
                return Native.CLAMOR_ERROR_ARGUMENT;
            if (frames == 0) return Native.CLAMOR_OK;
            bool entered = false;
            try {
                if (context.Handle.IsClosed) return Native.CLAMOR_ERROR_STATE;
                context.Handle.DangerousAddRef(ref entered);
                return Native.clamor_render(context.Handle.DangerousGetHandle(), handle,
                    ref samples[offset], (uint)frames);
            } catch (ObjectDisposedException) {  // closed between the two lines
                return Native.CLAMOR_ERROR_STATE;
            } finally {
                if (entered) context.Handle.DangerousRelease();
            }
        }
    }
}

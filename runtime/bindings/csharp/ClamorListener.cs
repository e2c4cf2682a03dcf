// ClamorListener.cs: a listener in a level, whose sound the audio thread renders.
using System;

namespace Clamor
{
    public sealed class Listener : IDisposable
    {
        private readonly Context context;
        private ulong handle;
        private readonly int channels;

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
                    SoundBytes = found.sound_bytes, Failures = found.failures };
            }
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

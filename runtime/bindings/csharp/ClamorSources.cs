// ClamorSources.cs: sounds, streams, groups and sources of the application's own.
using System;
using System.Runtime.InteropServices;
#if UNITY_5_3_OR_NEWER
using AOT;
#endif

namespace Clamor
{
    // A sound that any number of sources play, mono, in memory. Dispose() removes it with all sources
    // that play it, at the next commit.
    public class Sound : IDisposable
    {
        internal readonly Context Context;
        internal ulong Handle;

        internal Sound(Context context)
        {
            Context = context;
        }

        // Copies samples, 1 at full scale.
        public Sound(Context context, float[] samples, int rateHz = 48000, bool loops = false)
            : this(context)
        {
            if (samples == null || samples.Length == 0) throw new ArgumentException("there are no samples");
            var options = Options(rateHz, loops);
            var error = new byte[Native.ErrorBytes];
            ClamorException.Check(Native.clamor_add_sound(context.Handle, samples,
                (ulong)samples.Length, ref options, out Handle, error), error);
        }

        // Reads a WAV, FLAC, Ogg or MP3 file, whose channels are averaged.
        public Sound(Context context, string path, bool loops = false) : this(context)
        {
            var options = Options(0, loops);
            var error = new byte[Native.ErrorBytes];
            ClamorException.Check(Native.clamor_read_sound(context.Handle, Context.Utf8(path),
                ref options, out Handle, error), error);
        }

        // Reads one of a level's own sounds.
        public Sound(Context context, Level level, int number) : this(context)
        {
            var error = new byte[Native.ErrorBytes];
            ClamorException.Check(Native.clamor_read_level_sound(context.Handle, level.Handle,
                (uint)number, out Handle, error), error);
        }

        private static Native.clamor_sound_options Options(int rateHz, bool loops)
        {
            return new Native.clamor_sound_options { bytes = Native.clamor_sound_options.Size,
                rate_hz = (uint)rateHz, loops = loops ? 1u : 0u };
        }

        public virtual void Dispose()
        {
            if (Handle != 0 && !Context.Handle.IsClosed) Native.clamor_remove_sound(Context.Handle, Handle);
            Handle = 0;
        }
    }

    // A sound whose samples Write() brings while it plays: speech, a synthesiser.
    public sealed class StreamedSound : Sound
    {
        public StreamedSound(Context context, int rateHz = 48000) : base(context)
        {
            var options = new Native.clamor_stream { bytes = Native.clamor_stream.Size, rate_hz = (uint)rateHz };
            var error = new byte[Native.ErrorBytes];
            ClamorException.Check(
                Native.clamor_add_stream(context.Handle, ref options, out Handle, error), error);
        }

        // Audio thread, one at a time: appends samples and returns how many fitted into the buffer of
        // one second, or an error of clamor.h. Allocates nothing and never throws.
        public int Write(float[] samples, int offset, int frames)
        {
            if (samples == null || offset < 0 || frames < 0 || offset > samples.Length - frames)
                return Native.CLAMOR_ERROR_ARGUMENT;
            if (frames == 0) return 0;
            bool entered = false;
            try {
                if (Context.Handle.IsClosed) return Native.CLAMOR_ERROR_STATE;
                Context.Handle.DangerousAddRef(ref entered);
                uint taken;
                int code = Native.clamor_write_stream(Context.Handle.DangerousGetHandle(), Handle,
                    ref samples[offset], (uint)frames, out taken);
                return code == Native.CLAMOR_OK ? (int)taken : code;
            } catch (ObjectDisposedException) {
                return Native.CLAMOR_ERROR_STATE;
            } finally {
                if (entered) Context.Handle.DangerousRelease();
            }
        }
    }

    // Fills the first `frames` samples and returns how many it had; the rest are silence. The array is
    // the same in each call unless a longer one is needed.
    public delegate int PullFunction(float[] samples, int frames);

    // A sound whose samples a function brings when they are needed, some 90 ms ahead of the sound. It is
    // called on the thread that makes keyframes, and must not call functions of the context.
    public sealed class PulledSound : Sound
    {
        // The delegates live as long as the process, because the library keeps pointers to them.
        private static readonly Native.PullFunction pull = Pull;
        private static readonly Native.ReleaseFunction release = Release;

        private readonly Puller puller;

        public PulledSound(Context context, PullFunction function, int rateHz = 48000) : base(context)
        {
            if (function == null) throw new ArgumentNullException("function");
            puller = new Puller { Function = function };
            GCHandle user = GCHandle.Alloc(puller);
            var options = new Native.clamor_stream { bytes = Native.clamor_stream.Size,
                rate_hz = (uint)rateHz, user = GCHandle.ToIntPtr(user),
                pull = Marshal.GetFunctionPointerForDelegate(pull),
                release = Marshal.GetFunctionPointerForDelegate(release) };
            var error = new byte[Native.ErrorBytes];
            int code = Native.CLAMOR_ERROR_INTERNAL;
            try {
                code = Native.clamor_add_stream(context.Handle, ref options, out Handle, error);
            } finally {
                if (code != Native.CLAMOR_OK) user.Free();
            }
            ClamorException.Check(code, error);
        }

        // What the function has thrown last, or null. The samples were silence then.
        public Exception Failure
        {
            get { return puller.Failure; }
        }

        // The function is not called any more, once a call under way has returned.
        public override void Dispose()
        {
            base.Dispose();
            puller.Function = null;
        }

        private sealed class Puller
        {
            public volatile PullFunction Function;
            public volatile Exception Failure;
            public float[] Samples = new float[0];
        }

        [MonoPInvokeCallback(typeof(Native.ReleaseFunction))]
        private static void Release(IntPtr user)
        {
            GCHandle.FromIntPtr(user).Free();
        }

        [MonoPInvokeCallback(typeof(Native.PullFunction))]
        private static uint Pull(IntPtr user, IntPtr into, uint frames)
        {
            var puller = (Puller)GCHandle.FromIntPtr(user).Target;
            try {
                PullFunction function = puller.Function;
                if (function == null) return 0;
                if (puller.Samples.Length < frames) puller.Samples = new float[frames];
                int had = Math.Max(0, Math.Min((int)frames, function(puller.Samples, (int)frames)));
                Marshal.Copy(puller.Samples, 0, into, had);
                return (uint)had;
            } catch (Exception exception) {  // no exception can pass through the library
                puller.Failure = exception;
                return 0;
            }
        }
    }

    // A group of sources: a bus. Change() sets all of its properties, with the next commit.
    public sealed class Group : IDisposable
    {
        private readonly Context context;
        internal ulong Handle;

        public Group(Context context, double gain = 1, bool isMuted = false, bool isPaused = false,
            double maxVoices = 1)
        {
            this.context = context;
            var options = Options(gain, isMuted, isPaused, maxVoices);
            ClamorException.Check(Native.clamor_add_group(context.Handle, ref options, out Handle));
        }

        public void Change(double gain = 1, bool isMuted = false, bool isPaused = false, double maxVoices = 1)
        {
            var options = Options(gain, isMuted, isPaused, maxVoices);
            ClamorException.Check(Native.clamor_change_group(context.Handle, Handle, ref options));
        }

        private static Native.clamor_group_options Options(double gain, bool isMuted, bool isPaused,
            double maxVoices)
        {
            return new Native.clamor_group_options { bytes = Native.clamor_group_options.Size,
                is_muted = isMuted ? 1u : 0u, is_paused = isPaused ? 1u : 0u, has_gain = 1, gain = gain,
                max_voices = maxVoices };
        }

        public void Dispose()
        {
            if (Handle != 0 && !context.Handle.IsClosed) Native.clamor_remove_group(context.Handle, Handle);
            Handle = 0;
        }
    }

    // Where a source is, how it moves (zeros: as between the last two commits), and the axis of its
    // directivity (zeros: -Z).
    public struct Motion
    {
        public double X, Y, Z, VelocityX, VelocityY, VelocityZ, AxisX, AxisY, AxisZ;

        internal Native.clamor_motion ToNative()
        {
            return new Native.clamor_motion {
                position_m_0 = X, position_m_1 = Y, position_m_2 = Z, velocity_mps_0 = VelocityX,
                velocity_mps_1 = VelocityY, velocity_mps_2 = VelocityZ, axis_0 = AxisX, axis_1 = AxisY,
                axis_2 = AxisZ };
        }
    }

    // As clamor_source_options in clamor.h; 0 and null mean the default.
    public sealed class SourceOptions
    {
        public Sound Sound;
        public Group Group;
        public Level Level;
        public Motion Motion;
        public double Gain, Directivity, PlayedS;
        public double[] BandGains;  // eight amplitudes, 63 Hz to 8 kHz
        // Amplitude of its reflections, which are those of the probes of the bake; null: 1. 0: direct
        // sound only.
        public double? Reverberation;
        public bool EndsWithSound;

        internal Native.clamor_source_options ToNative()
        {
            if (BandGains != null && BandGains.Length != 8)
                throw new ArgumentException("BandGains has eight numbers");
            var options = new Native.clamor_source_options {
                bytes = Native.clamor_source_options.Size, ends_with_sound = EndsWithSound ? 1u : 0u,
                sound = Sound == null ? 0 : Sound.Handle, group = Group == null ? 0 : Group.Handle,
                level = Level == null ? 0 : Level.Handle, motion = Motion.ToNative(), gain = Gain,
                directivity_0 = Directivity, directivity_1 = Directivity, directivity_2 = Directivity,
                directivity_3 = Directivity, directivity_4 = Directivity, directivity_5 = Directivity,
                directivity_6 = Directivity, directivity_7 = Directivity, played_s = PlayedS,
                has_reverberation = Reverberation.HasValue ? 1u : 0u,
                reverberation = Reverberation.GetValueOrDefault() };
            if (BandGains == null) return options;
            options.band_gains_0 = BandGains[0];
            options.band_gains_1 = BandGains[1];
            options.band_gains_2 = BandGains[2];
            options.band_gains_3 = BandGains[3];
            options.band_gains_4 = BandGains[4];
            options.band_gains_5 = BandGains[5];
            options.band_gains_6 = BandGains[6];
            options.band_gains_7 = BandGains[7];
            return options;
        }
    }

    // A source that the application moves. It begins with the next Context.Commit().
    public sealed class Source : IDisposable
    {
        private readonly Context context;
        private ulong handle;

        public Source(Context context, SourceOptions options)
        {
            this.context = context;
            Native.clamor_source_options given = options.ToNative();
            ClamorException.Check(Native.clamor_add_source(context.Handle, ref given, out handle));
        }

        // Sets all of its properties; another sound begins anew.
        public void Change(SourceOptions options)
        {
            Native.clamor_source_options given = options.ToNative();
            ClamorException.Check(Native.clamor_change_source(context.Handle, handle, ref given));
        }

        public void Move(Motion motion)
        {
            Native.clamor_motion moved = motion.ToNative();
            ClamorException.Check(Native.clamor_move_source(context.Handle, handle, ref moved));
        }

        // Fades out within a tenth of a second after the next commit.
        public void Dispose()
        {
            if (handle != 0 && !context.Handle.IsClosed) Native.clamor_remove_source(context.Handle, handle);
            handle = 0;
        }
    }
}

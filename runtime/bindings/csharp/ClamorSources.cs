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
    public class Sound : ContextObject
    {
        internal Sound(Context context) : base(context) { }

        // Copies samples, 1 at full scale.
        public Sound(Context context, float[] samples, int rateHz = 48000, bool loops = false)
            : this(context)
        {
            if (samples == null || samples.Length == 0) throw new ArgumentException("there are no samples");
            Handle = Native.AddSound(context.Handle, samples, (ulong)samples.Length, Options(rateHz, loops));
        }

        // Reads a WAV, FLAC, Ogg or MP3 file, whose channels are averaged.
        public Sound(Context context, string path, bool loops = false) : this(context) =>
            Handle = Native.ReadSound(context.Handle, path, Options(0, loops));

        // Reads one of a level's own sounds.
        public Sound(Context context, Level level, int number) : this(context) =>
            Handle = Native.ReadLevelSound(context.Handle, level.Handle, (uint)number);

        private static Native.clamor_sound_options Options(int rateHz, bool loops) =>
            new Native.clamor_sound_options { rate_hz = (uint)rateHz, loops = loops ? 1u : 0u };

        internal override int GiveBack() => Native.clamor_remove_sound(Context.Handle, Handle);
    }

    // A sound whose samples Write() brings while it plays: speech, a synthesiser.
    public sealed class StreamedSound : Sound
    {
        public StreamedSound(Context context, int rateHz = 48000) : base(context) =>
            Handle = Native.AddStream(context.Handle, new Native.clamor_stream { rate_hz = (uint)rateHz });

        // Audio thread, one at a time: appends samples and returns how many fitted into the buffer of
        // one second, or an error of clamor.h. Allocates nothing and never throws.
        public int Write(float[] samples, int offset, int frames)
        {
            if (samples == null || offset < 0 || frames < 0 || offset > samples.Length - frames)
                return Native.CLAMOR_ERROR_ARGUMENT;
            if (frames == 0) return 0;
            if (!Context.Handle.TryHold()) return Native.CLAMOR_ERROR_STATE;
            int code = Native.clamor_write_stream(Context.Handle.DangerousGetHandle(), Handle,
                ref samples[offset], (uint)frames, out uint taken);
            Context.Handle.DangerousRelease();
            return code == Native.CLAMOR_OK ? (int)taken : code;
        }
    }

    // Fills the first `frames` samples and returns how many it had; the rest are silence. The array is
    // the same in each call unless a longer one is needed.
    public delegate int PullFunction(float[] samples, int frames);

    // A sound whose samples a function brings when they are needed, some 90 ms ahead of the sound. It is
    // called on the thread that makes keyframes, and must not call functions of the context.
    public sealed class PulledSound : Sound
    {
        // It lives as long as the process, because the library keeps a pointer to it.
        private static readonly Native.PullFunction pull = Pull;

        private readonly Puller puller;

        public PulledSound(Context context, PullFunction function, int rateHz = 48000) : base(context)
        {
            if (function == null) throw new ArgumentNullException("function");
            puller = new Puller { Function = function };
            var options = new Native.clamor_stream { rate_hz = (uint)rateHz,
                pull = Marshal.GetFunctionPointerForDelegate(pull),
                release = Marshal.GetFunctionPointerForDelegate(Context.Free) };
            Handle = Context.Keeping(GCHandle.Alloc(puller), user => {
                options.user = user;
                return Native.AddStream(context.Handle, options);
            });
        }

        // What the function has thrown last, or null. The samples were silence then.
        public Exception Failure => puller.Failure;

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
    public sealed class Group : ContextObject
    {
        public Group(Context context, double gain = 1, bool isMuted = false, bool isPaused = false,
            double maxVoices = 1) : base(context) =>
            Handle = Native.AddGroup(context.Handle, Options(gain, isMuted, isPaused, maxVoices));

        public void Change(double gain = 1, bool isMuted = false, bool isPaused = false, double maxVoices = 1) =>
            Native.ChangeGroup(Context.Handle, Handle, Options(gain, isMuted, isPaused, maxVoices));

        private static Native.clamor_group_options Options(double gain, bool isMuted, bool isPaused,
            double maxVoices) =>
            new Native.clamor_group_options { is_muted = isMuted ? 1u : 0u,
                is_paused = isPaused ? 1u : 0u, has_gain = 1, gain = gain, max_voices = maxVoices };

        internal override int GiveBack() => Native.clamor_remove_group(Context.Handle, Handle);
    }

    // Where a source is, how it moves (zeros: as between the last two commits), and the axis of its
    // directivity (zeros: -Z).
    [StructLayout(LayoutKind.Sequential)]  // as clamor_motion
    public struct Motion
    {
        public double X, Y, Z, VelocityX, VelocityY, VelocityZ, AxisX, AxisY, AxisZ;
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

        internal Native.clamor_source_options ToNative() =>
            new Native.clamor_source_options {
                ends_with_sound = EndsWithSound ? 1u : 0u, sound = ContextObject.HandleOf(Sound),
                group = ContextObject.HandleOf(Group), level = ContextObject.HandleOf(Level),
                motion = Motion, gain = Gain,
                band_gains = Doubles8.Of(BandGains, 0, "BandGains"),
                directivity = Doubles8.Of(null, Directivity, "Directivity"), played_s = PlayedS,
                has_reverberation = Reverberation.HasValue ? 1u : 0u,
                reverberation = Reverberation.GetValueOrDefault() };
    }

    // A source that the application moves. It begins with the next Context.Commit().
    public sealed class Source : ContextObject
    {
        public Source(Context context, SourceOptions options)
            : base(context, Native.AddSource(context.Handle, options.ToNative())) { }

        // Sets all of its properties; another sound begins anew.
        public void Change(SourceOptions options) =>
            Native.ChangeSource(Context.Handle, Handle, options.ToNative());

        public void Move(Motion motion) => Native.MoveSource(Context.Handle, Handle, motion);

        // Fades out within a tenth of a second after the commit that follows Dispose().
        internal override int GiveBack() => Native.clamor_remove_source(Context.Handle, Handle);
    }
}

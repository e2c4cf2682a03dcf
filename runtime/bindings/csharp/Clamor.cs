// Clamor.cs: Clamor in C#: opens baked levels and renders what listeners hear in them.
//
//   var clamor = new Clamor.Context();
//   var level = clamor.OpenLevel("hall.clamor");
//   var ears = clamor.CreateListener(level, new Clamor.ListenerOptions { RateHz = 48000 });
//
//   game thread:   ears.Move(new Clamor.Pose(0, 1.7, 3));
//   audio thread:  ears.Render(samples, 0, frames);
//
// Functions throw ClamorException where those of clamor.h return an error, except Listener.Render(),
// which is for the audio thread: it returns the code, allocates no managed memory and never throws.
//
// Needs C# 7.3, no unsafe code, no LINQ, no Span: Mono, .NET and Unity 2021 with Mono or IL2CPP.
using System;
using System.Runtime.InteropServices;
#if UNITY_5_3_OR_NEWER
using AOT;
#endif

namespace Clamor
{
    public sealed class ClamorException : Exception
    {
        public ClamorException(int code, string sentence) : base(sentence) => Code = code;

        // One of clamor.h's, for example -3 for a file that cannot be read.
        public int Code { get; private set; }
    }

    // A position in metres and an orientation, the quaternion of any length but 0 from the head's
    // frame to the level's. The frame is that of glTF: +X right, +Y up; a listener whose orientation
    // is the identity looks along -Z.
    [StructLayout(LayoutKind.Sequential)]  // as clamor_pose
    public struct Pose
    {
        public double X, Y, Z;
        public double QuaternionX, QuaternionY, QuaternionZ, QuaternionW;

        public Pose(double x, double y, double z, double quaternionX = 0, double quaternionY = 0,
            double quaternionZ = 0, double quaternionW = 1)
        {
            X = x;
            Y = y;
            Z = z;
            QuaternionX = quaternionX;
            QuaternionY = quaternionY;
            QuaternionZ = quaternionZ;
            QuaternionW = quaternionW;
        }

        // From Unity's frame, which is left-handed and looks along +Z, in a scene where the importer of
        // the level has inverted the X axis, as UnityGLTF does; its camera looks along the glTF's +Z.
        public static Pose FromInvertedX(double x, double y, double z, double quaternionX,
            double quaternionY, double quaternionZ, double quaternionW) =>
            new Pose(-x, y, z, quaternionZ, quaternionW, quaternionX, quaternionY);

        // The same where the importer has inverted the Z axis, as UniVRM does.
        public static Pose FromInvertedZ(double x, double y, double z, double quaternionX,
            double quaternionY, double quaternionZ, double quaternionW) =>
            new Pose(x, y, -z, -quaternionX, -quaternionY, quaternionZ, quaternionW);
    }

    public enum Output
    {
        Binaural = Native.CLAMOR_OUTPUT_BINAURAL,
        Loudspeakers = Native.CLAMOR_OUTPUT_LOUDSPEAKERS,
        Ambisonics = Native.CLAMOR_OUTPUT_AMBISONICS,
        Receivers = Native.CLAMOR_OUTPUT_RECEIVERS,
        None = Native.CLAMOR_OUTPUT_NONE
    }

    public enum Mixing
    {
        Auto = Native.CLAMOR_MIXING_AUTO,
        Field = Native.CLAMOR_MIXING_FIELD,
        Voices = Native.CLAMOR_MIXING_VOICES
    }

    public enum Late { Stored = Native.CLAMOR_LATE_STORED, Dense = Native.CLAMOR_LATE_DENSE }

    // As clamor_listener_options in clamor.h; 0 and null mean the default.
    public sealed class ListenerOptions
    {
        public Output Output;
        public Mixing Mixing;
        public Late Late;
        public string Layout, Sofa;
        public int RateHz, MaxBlockFrames, Voices;
        public long MemoryBytes;
        public double Gain;
        public bool Limits, Offline, ReportsVoices;
        public Pose Pose = new Pose(0, 0, 0);
    }

    public struct LevelInfo
    {
        public int Emitters, Sounds, Portals, Parts;
        public ulong Sources;
    }

    // An emitter of a level: its name in glTF, the number of its sound, its position in metres and its
    // amplitude at 1 m.
    public struct EmitterInfo
    {
        public string Name;
        public int Sound;
        public double X, Y, Z, Gain;
    }

    // A portal of a level: its name, and its rectangle in metres, the points centre + a halfU + b halfV
    // with a and b between -1 and 1. Each vector is x, y, z.
    public struct PortalInfo
    {
        public string Name;
        public double[] CentreM, HalfUM, HalfVM;
    }

    public struct ListenerStatistics
    {
        public int Voices;
        public ulong Keyframes, HeldBlocks;
        public double KeyframeMs;
        public ulong Pages, PageBytes, SoundBytes, Failures;
        public int UnseenSources;
    }

    // A bake in the application's own archive.
    public interface ILevelReader
    {
        ulong Size { get; }
        // Copies `count` bytes from `offset` on to `into`. Called by several threads at a time, never
        // by the audio thread. What it throws makes the read fail.
        void Read(ulong offset, ulong count, IntPtr into);
    }

    // A world: open levels, and listeners in them. Contexts do not see each other.
    public sealed class Context : IDisposable
    {
        // The delegates live as long as the process, because the library keeps pointers to them.
        private static readonly Native.ReadFunction read = Read;
        private static readonly Native.LogFunction tell = Tell;
        internal static readonly Native.ReleaseFunction Free = Release;

        internal readonly NativeHandle Handle;

        // callerUpdates: false: the library makes keyframes on a thread of its own. True: Update() is
        // called regularly, at least every `updatePeriodS` (0: 1/30 s), and no thread is started.
        // log: is called with a sentence for what no call can return, such as a page that cannot be
        // read; by any thread, and must not call this object. It is kept until Dispose().
        public Context(bool callerUpdates = false, double updatePeriodS = 0, Action<string> log = null)
        {
            if (Native.clamor_abi_version() != Native.CLAMOR_ABI_VERSION)
                throw new ClamorException(Native.CLAMOR_ERROR_STATE,
                    "libclamor has another ABI version than Clamor.cs; install both of one version");
            var options = new Native.clamor_options {
                caller_updates = callerUpdates ? 1u : 0u, update_period_s = updatePeriodS };
            if (log == null) {
                Handle = new NativeHandle(Native.Create(options), context => Native.clamor_destroy(context));
                return;
            }
            GCHandle kept = GCHandle.Alloc(log);
            options.log = Marshal.GetFunctionPointerForDelegate(tell);
            Handle = Keeping(kept, user => {
                options.user = user;
                return new NativeHandle(Native.Create(options), context => {
                    Native.clamor_destroy(context);
                    kept.Free();
                });
            });
        }

        // Makes what keeps an object, which the library frees; it is freed here if that throws.
        internal static T Keeping<T>(GCHandle kept, Func<IntPtr, T> make)
        {
            try {
                return make(GCHandle.ToIntPtr(kept));
            } catch (Exception) {
                kept.Free();
                throw;
            }
        }

        // Frees the context and all that belongs to it, once a Render() under way has returned.
        public void Dispose() => Handle.Dispose();

        // Makes the keyframes that listeners want now and returns how many; then loads pages and
        // sounds until none are requested or `loadingS` seconds have passed.
        public int Update(double loadingS = 0) => (int)Native.Update(Handle, loadingS);

        // Publishes all changes of sounds, sources, emitters, portals, groups and parts together.
        // `timeS` is the time of an offline listener that they are for; listeners in real time take
        // them over now.
        public void Commit(double timeS = 0) => Native.Commit(Handle, timeS);

        public Level OpenLevel(string path) => new Level(this, Native.OpenLevel(Handle, path));

        // Opens a bake in memory. The bytes stay pinned until the library no longer reads them.
        public Level OpenLevel(byte[] bytes, string name)
        {
            var pinned = GCHandle.Alloc(bytes, GCHandleType.Pinned);
            return OpenLevel(new Native.clamor_reader {
                size = (ulong)bytes.LongLength, memory = pinned.AddrOfPinnedObject() }, name, pinned);
        }

        public Level OpenLevel(ILevelReader reader, string name) =>
            OpenLevel(new Native.clamor_reader {
                size = reader.Size, read = Marshal.GetFunctionPointerForDelegate(read) }, name,
                GCHandle.Alloc(reader));

        private Level OpenLevel(Native.clamor_reader reader, string name, GCHandle kept)
        {
            using (var memory = new NativeMemory())
                return Keeping(kept, user => {
                    reader.name = memory.Text(name);
                    reader.user = user;
                    reader.release = Marshal.GetFunctionPointerForDelegate(Free);
                    return new Level(this, Native.OpenLevelWith(Handle, reader));
                });
        }

        [MonoPInvokeCallback(typeof(Native.LogFunction))]
        private static void Tell(IntPtr user, IntPtr sentence)
        {
            try {
                ((Action<string>)GCHandle.FromIntPtr(user).Target)(NativeMemory.Read(sentence));
            } catch (Exception) {  // no exception can pass through the library
            }
        }

        [MonoPInvokeCallback(typeof(Native.ReadFunction))]
        private static int Read(IntPtr user, ulong offset, ulong count, IntPtr into)
        {
            try {
                ((ILevelReader)GCHandle.FromIntPtr(user).Target).Read(offset, count, into);
                return 0;
            } catch (Exception) {  // no exception can pass through the library
                return 1;
            }
        }

        [MonoPInvokeCallback(typeof(Native.ReleaseFunction))]
        private static void Release(IntPtr user) => GCHandle.FromIntPtr(user).Free();

        public Listener CreateListener(Level level, ListenerOptions options)
        {
            using (var memory = new NativeMemory())
                return new Listener(this, Native.CreateListener(Handle, level.Handle,
                    new Native.clamor_listener_options {
                        output = (uint)options.Output, layout = memory.Text(options.Layout),
                        sofa = memory.Text(options.Sofa), rate_hz = (uint)options.RateHz,
                        max_block_frames = (uint)options.MaxBlockFrames, voices = (uint)options.Voices,
                        memory_bytes = (ulong)options.MemoryBytes, gain = options.Gain,
                        limits = options.Limits ? 1u : 0u, offline = options.Offline ? 1u : 0u,
                        pose = options.Pose,
                        reports_voices = options.ReportsVoices ? 1u : 0u,
                        mixing = (ulong)options.Mixing, late = (ulong)options.Late }));
        }
    }

    // An open level. Listeners who are in it hear it on after it is disposed of.
    public sealed class Level : ContextObject
    {
        internal Level(Context context, ulong handle) : base(context, handle) { }

        internal override int GiveBack() => Native.clamor_close_level(Context.Handle, Handle);

        // The emitter number `number`, below Info.Emitters.
        public EmitterInfo Emitter(int number)
        {
            var info = Native.GetEmitterInfo(Context.Handle, Handle, (uint)number);
            return new EmitterInfo { Name = NativeMemory.Read(info.name), Sound = (int)info.sound,
                X = info.position_m._0, Y = info.position_m._1, Z = info.position_m._2, Gain = info.gain };
        }

        // Whether there is what a function looks for by its name.
        private static bool IsFound(int code)
        {
            if (code != Native.CLAMOR_ERROR_NOT_FOUND) Native.Check(code, null);
            return code == Native.CLAMOR_OK;
        }

        // The number of the first emitter with this name; -1: there is none.
        public int FindEmitter(string name) =>
            IsFound(Native.clamor_find_emitter(Context.Handle, Handle, NativeMemory.Utf8(name),
                out uint number)) ? (int)number : -1;

        // Turns an emitter down, with all its reflections, for all listeners from the next commit. The
        // gain is an amplitude relative to the bake's, 0 to 1, times that of the group.
        public void ChangeEmitter(int number, double gain = 1, bool isMuted = false, Group group = null) =>
            Native.ChangeEmitter(Context.Handle, Handle, (uint)number, new Native.clamor_emitter_options {
                is_muted = isMuted ? 1u : 0u, has_gain = 1, group = HandleOf(group), gain = gain });

        // The portal number `number`, below Info.Portals.
        public PortalInfo Portal(int number)
        {
            var info = Native.GetPortalInfo(Context.Handle, Handle, (uint)number);
            return new PortalInfo { Name = NativeMemory.Read(info.name), CentreM = info.centre_m.ToArray(),
                HalfUM = info.half_u_m.ToArray(), HalfVM = info.half_v_m.ToArray() };
        }

        // The number of the first portal with this name; -1: there is none.
        public int FindPortal(string name) =>
            IsFound(Native.clamor_find_portal(Context.Handle, Handle, NativeMemory.Utf8(name),
                out uint number)) ? (int)number : -1;

        // Opens or closes a portal for all listeners from the next commit: the share of power, 0 to 1,
        // that is left of reflections that came through it.
        public void SetPortal(int number, double openness) =>
            Native.SetPortal(Context.Handle, Handle, (uint)number, openness);

        // The movable part number `number`, below Info.Parts.
        public Part Part(int number) =>
            new Part(Context, Native.GetLevelPart(Context.Handle, Handle, (uint)number));

        // The first movable part with this name; null: there is none.
        public Part FindPart(string name) =>
            IsFound(Native.clamor_find_part(Context.Handle, Handle, NativeMemory.Utf8(name),
                out ulong part)) ? new Part(Context, part) : null;

        // Measures the response to an impulse of one emitter (-1: of all) at each place: x, y, z in
        // metres, one place after the other. Returns `frames` samples at 48 kHz for each.
        public float[] MeasureResponses(double[] placesM, int frames, int emitter = 0)
        {
            var samples = new float[placesM.Length / 3 * frames];
            Native.MeasureResponses(Context.Handle, Handle, (uint)emitter, placesM,
                (uint)(placesM.Length / 3), samples, (ulong)frames);
            return samples;
        }

        public LevelInfo Info
        {
            get {
                var info = Native.GetLevelInfo(Context.Handle, Handle);
                return new LevelInfo { Emitters = (int)info.emitters, Sounds = (int)info.sounds,
                    Portals = (int)info.portals, Parts = (int)info.parts, Sources = info.sources };
            }
        }
    }
}

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
using System.Text;
#if UNITY_5_3_OR_NEWER
using AOT;
#endif

namespace Clamor
{
    public sealed class ClamorException : Exception
    {
        public ClamorException(int code, string sentence) : base(sentence)
        {
            Code = code;
        }

        // One of clamor.h's, for example -3 for a file that cannot be read.
        public int Code { get; private set; }

        internal static void Check(int code)
        {
            if (code != Native.CLAMOR_OK)
                throw new ClamorException(code, Marshal.PtrToStringAnsi(Native.clamor_result_text(code)));
        }

        internal static void Check(int code, byte[] error)
        {
            if (code == Native.CLAMOR_OK) return;
            int end = Array.IndexOf(error, (byte)0, 4);
            throw new ClamorException(code, Encoding.UTF8.GetString(error, 4, end - 4));
        }
    }

    // A position in metres and an orientation, the quaternion of any length but 0 from the head's
    // frame to the level's. The frame is that of glTF: +X right, +Y up; a listener whose orientation
    // is the identity looks along -Z.
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
            double quaternionY, double quaternionZ, double quaternionW)
        {
            return new Pose(-x, y, z, quaternionZ, quaternionW, quaternionX, quaternionY);
        }

        // The same where the importer has inverted the Z axis, as UniVRM does.
        public static Pose FromInvertedZ(double x, double y, double z, double quaternionX,
            double quaternionY, double quaternionZ, double quaternionW)
        {
            return new Pose(x, y, -z, -quaternionX, -quaternionY, quaternionZ, quaternionW);
        }

        internal static Pose FromNative(Native.clamor_pose pose)
        {
            return new Pose(pose.position_m_0, pose.position_m_1, pose.position_m_2,
                pose.orientation_0, pose.orientation_1, pose.orientation_2, pose.orientation_3);
        }

        internal Native.clamor_pose ToNative()
        {
            return new Native.clamor_pose {
                position_m_0 = X, position_m_1 = Y, position_m_2 = Z,
                orientation_0 = QuaternionX, orientation_1 = QuaternionY,
                orientation_2 = QuaternionZ, orientation_3 = QuaternionW };
        }
    }

    public enum Output
    {
        Binaural = Native.CLAMOR_OUTPUT_BINAURAL,
        Loudspeakers = Native.CLAMOR_OUTPUT_LOUDSPEAKERS,
        Ambisonics = Native.CLAMOR_OUTPUT_AMBISONICS,
        Receivers = Native.CLAMOR_OUTPUT_RECEIVERS,
        None = Native.CLAMOR_OUTPUT_NONE
    }

    // As clamor_listener_options in clamor.h; 0 and null mean the default.
    public sealed class ListenerOptions
    {
        public Output Output;
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
        private static readonly Native.ReleaseFunction release = Release;

        internal readonly ContextHandle Handle;

        private static readonly Native.LogFunction tell = Tell;

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
                bytes = Native.clamor_options.Size, caller_updates = callerUpdates ? 1u : 0u,
                update_period_s = updatePeriodS };
            GCHandle self = default(GCHandle);
            if (log != null) {
                self = GCHandle.Alloc(log);
                options.user = GCHandle.ToIntPtr(self);
                options.log = Marshal.GetFunctionPointerForDelegate(tell);
            }
            var error = new byte[Native.ErrorBytes];
            IntPtr context;
            int code = Native.clamor_create(ref options, out context, error);
            if (code != Native.CLAMOR_OK && self.IsAllocated) self.Free();
            ClamorException.Check(code, error);
            Handle = new ContextHandle(context, self);
        }

        // Frees the context and all that belongs to it, once a Render() under way has returned.
        public void Dispose()
        {
            Handle.Dispose();
        }

        // Makes the keyframes that listeners want now and returns how many; then loads pages and
        // sounds until none are requested or `loadingS` seconds have passed.
        public int Update(double loadingS = 0)
        {
            uint made;
            ClamorException.Check(Native.clamor_update(Handle, loadingS, out made));
            return (int)made;
        }

        // Publishes all changes of sounds, sources, emitters, portals, groups and parts together.
        // `timeS` is the time of an offline listener that they are for; listeners in real time take
        // them over now.
        public void Commit(double timeS = 0)
        {
            ClamorException.Check(Native.clamor_commit(Handle, timeS));
        }

        public Level OpenLevel(string path)
        {
            var error = new byte[Native.ErrorBytes];
            ulong level;
            ClamorException.Check(
                Native.clamor_open_level(Handle, Utf8(path), out level, error), error);
            return new Level(this, level);
        }

        // Opens a bake in memory. The bytes stay pinned until the library no longer reads them.
        public Level OpenLevel(byte[] bytes, string name)
        {
            var pinned = GCHandle.Alloc(bytes, GCHandleType.Pinned);
            return OpenLevel(new Native.clamor_reader {
                size = (ulong)bytes.LongLength, memory = pinned.AddrOfPinnedObject() }, name, pinned);
        }

        public Level OpenLevel(ILevelReader reader, string name)
        {
            return OpenLevel(new Native.clamor_reader {
                size = reader.Size, read = Marshal.GetFunctionPointerForDelegate(read) }, name,
                GCHandle.Alloc(reader));
        }

        private Level OpenLevel(Native.clamor_reader reader, string name, GCHandle kept)
        {
            var error = new byte[Native.ErrorBytes];
            ulong level = 0;
            int code = Native.CLAMOR_ERROR_INTERNAL;
            using (var text = new NativeText(name)) {
                reader.bytes = Native.clamor_reader.Size;
                reader.name = text.Pointer;
                reader.user = GCHandle.ToIntPtr(kept);
                reader.release = Marshal.GetFunctionPointerForDelegate(release);
                try {
                    code = Native.clamor_open_level_with(Handle, ref reader, out level, error);
                } finally {
                    if (code != Native.CLAMOR_OK) kept.Free();
                }
            }
            ClamorException.Check(code, error);
            return new Level(this, level);
        }

        [MonoPInvokeCallback(typeof(Native.LogFunction))]
        private static void Tell(IntPtr user, IntPtr sentence)
        {
            try {
                ((Action<string>)GCHandle.FromIntPtr(user).Target)(NativeText.Read(sentence));
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
        private static void Release(IntPtr user)
        {
            GCHandle.FromIntPtr(user).Free();
        }

        public Listener CreateListener(Level level, ListenerOptions options)
        {
            var error = new byte[Native.ErrorBytes];
            ulong listener;
            using (var layout = new NativeText(options.Layout))
            using (var sofa = new NativeText(options.Sofa)) {
                var given = new Native.clamor_listener_options {
                    bytes = Native.clamor_listener_options.Size, output = (uint)options.Output,
                    layout = layout.Pointer, sofa = sofa.Pointer, rate_hz = (uint)options.RateHz,
                    max_block_frames = (uint)options.MaxBlockFrames, voices = (uint)options.Voices,
                    memory_bytes = (ulong)options.MemoryBytes, gain = options.Gain,
                    limits = options.Limits ? 1u : 0u, offline = options.Offline ? 1u : 0u,
                    pose = options.Pose.ToNative(),
                    reports_voices = options.ReportsVoices ? 1u : 0u };
                ClamorException.Check(Native.clamor_create_listener(Handle, level.Handle, ref given,
                    out listener, error), error);
            }
            return new Listener(this, listener);
        }

        internal static byte[] Utf8(string text)
        {
            return Encoding.UTF8.GetBytes(text + "\0");
        }
    }

    // A string of UTF-8 outside of the managed heap; null stays null.
    internal struct NativeText : IDisposable
    {
        public readonly IntPtr Pointer;

        public NativeText(string text)
        {
            Pointer = IntPtr.Zero;
            if (text == null) return;
            byte[] bytes = Context.Utf8(text);
            Pointer = Marshal.AllocHGlobal(bytes.Length);
            Marshal.Copy(bytes, 0, Pointer, bytes.Length);
        }

        // The text at a pointer that the library gave.
        public static string Read(IntPtr text)
        {
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) ++length;
            var bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
        }

        public void Dispose()
        {
            Marshal.FreeHGlobal(Pointer);
        }
    }

    // An open level. Listeners who are in it hear it on after it is disposed of.
    public sealed class Level : IDisposable
    {
        private readonly Context context;
        internal ulong Handle { get; private set; }

        internal Level(Context context, ulong handle)
        {
            this.context = context;
            Handle = handle;
        }

        public void Dispose()
        {
            if (Handle != 0 && !context.Handle.IsClosed) Native.clamor_close_level(context.Handle, Handle);
            Handle = 0;
        }

        // The emitter number `number`, below Info.Emitters.
        public EmitterInfo Emitter(int number)
        {
            var info = new Native.clamor_emitter_info { bytes = Native.clamor_emitter_info.Size };
            ClamorException.Check(
                Native.clamor_get_emitter_info(context.Handle, Handle, (uint)number, ref info));
            return new EmitterInfo { Name = NativeText.Read(info.name), Sound = (int)info.sound,
                X = info.position_m_0, Y = info.position_m_1, Z = info.position_m_2, Gain = info.gain };
        }

        // The number of the first emitter with this name; -1: there is none.
        public int FindEmitter(string name)
        {
            uint number;
            int code = Native.clamor_find_emitter(context.Handle, Handle, Context.Utf8(name), out number);
            if (code == Native.CLAMOR_ERROR_NOT_FOUND) return -1;
            ClamorException.Check(code);
            return (int)number;
        }

        // Turns an emitter down, with all its reflections, for all listeners from the next commit. The
        // gain is an amplitude relative to the bake's, 0 to 1, times that of the group.
        public void ChangeEmitter(int number, double gain = 1, bool isMuted = false, Group group = null)
        {
            var options = new Native.clamor_emitter_options {
                bytes = Native.clamor_emitter_options.Size, is_muted = isMuted ? 1u : 0u, has_gain = 1,
                group = group == null ? 0 : group.Handle, gain = gain };
            ClamorException.Check(
                Native.clamor_change_emitter(context.Handle, Handle, (uint)number, ref options));
        }

        // The portal number `number`, below Info.Portals.
        public PortalInfo Portal(int number)
        {
            var info = new Native.clamor_portal_info { bytes = Native.clamor_portal_info.Size };
            ClamorException.Check(
                Native.clamor_get_portal_info(context.Handle, Handle, (uint)number, ref info));
            return new PortalInfo { Name = NativeText.Read(info.name),
                CentreM = new[] { info.centre_m_0, info.centre_m_1, info.centre_m_2 },
                HalfUM = new[] { info.half_u_m_0, info.half_u_m_1, info.half_u_m_2 },
                HalfVM = new[] { info.half_v_m_0, info.half_v_m_1, info.half_v_m_2 } };
        }

        // The number of the first portal with this name; -1: there is none.
        public int FindPortal(string name)
        {
            uint number;
            int code = Native.clamor_find_portal(context.Handle, Handle, Context.Utf8(name), out number);
            if (code == Native.CLAMOR_ERROR_NOT_FOUND) return -1;
            ClamorException.Check(code);
            return (int)number;
        }

        // Opens or closes a portal for all listeners from the next commit: the share of power, 0 to 1,
        // that is left of reflections that came through it.
        public void SetPortal(int number, double openness)
        {
            ClamorException.Check(
                Native.clamor_set_portal(context.Handle, Handle, (uint)number, openness));
        }

        // The movable part number `number`, below Info.Parts.
        public Part Part(int number)
        {
            ulong part;
            ClamorException.Check(
                Native.clamor_get_level_part(context.Handle, Handle, (uint)number, out part));
            return new Part(context, part);
        }

        // The first movable part with this name; null: there is none.
        public Part FindPart(string name)
        {
            ulong part;
            int code = Native.clamor_find_part(context.Handle, Handle, Context.Utf8(name), out part);
            if (code == Native.CLAMOR_ERROR_NOT_FOUND) return null;
            ClamorException.Check(code);
            return new Part(context, part);
        }

        // Measures the response to an impulse of one emitter (-1: of all) at each place: x, y, z in
        // metres, one place after the other. Returns `frames` samples at 48 kHz for each.
        public float[] MeasureResponses(double[] placesM, int frames, int emitter = 0)
        {
            var error = new byte[Native.ErrorBytes];
            var samples = new float[placesM.Length / 3 * frames];
            ulong whole;
            ClamorException.Check(Native.clamor_measure_responses(context.Handle, Handle,
                (uint)emitter, placesM, (uint)(placesM.Length / 3), samples, (ulong)frames, out whole,
                error), error);
            return samples;
        }

        public LevelInfo Info
        {
            get {
                var info = new Native.clamor_level_info { bytes = Native.clamor_level_info.Size };
                ClamorException.Check(Native.clamor_get_level_info(context.Handle, Handle, ref info));
                return new LevelInfo { Emitters = (int)info.emitters, Sounds = (int)info.sounds,
                    Portals = (int)info.portals, Parts = (int)info.parts, Sources = info.sources };
            }
        }
    }
}

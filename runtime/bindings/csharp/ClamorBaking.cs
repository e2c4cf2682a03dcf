// ClamorBaking.cs: bakes levels: a glTF file, or an application's triangles. Needs libclamor_bake.
//
//   using (var level = Clamor.BakeLevel.Read("hall.glb"))
//       level.Bake("hall.clamor", new Clamor.BakeOptions { Photons = 100000 });
//
// The file has the bytes that `clamor bake` writes. Functions throw ClamorException where those of
// clamor_bake.h return an error. A thread that bakes waits, and callbacks are called on it.
using System;
using System.Collections.Generic;
using System.Runtime.ExceptionServices;
using System.Runtime.InteropServices;
using System.Text;
#if UNITY_5_3_OR_NEWER
using AOT;
#endif

namespace Clamor
{
    // As clamor_bake_level_options in clamor_bake.h; null means the default.
    public sealed class BakeLevelOptions
    {
        public string Acoustics, Material;
        public string[] Emitters;  // each as "name=violin,signal=violin.flac,at=1,1.2,-3"
        public bool HiddenMeshes;
    }

    // As clamor_bake_material: arrays have eight values, 63 Hz to 8 kHz; null is the preset's.
    public sealed class BakeMaterial
    {
        public string Name, Preset;
        public float[] Absorption, Scattering, Phong, Transmission;
    }

    // As clamor_bake_sound: a file, "noise" or "impulse", or samples.
    public sealed class BakeSound
    {
        public string Name, Path;
        public float[] Samples;
        public int RateHz;
        public bool PlaysOnce;
    }

    // As clamor_bake_emitter; 0 and null mean the default.
    public sealed class BakeEmitter
    {
        public int Sound;
        public string Name;
        public double X, Y, Z, FacingX, FacingY, FacingZ, Gain, Directivity, DelayS;
        public float[] DirectivityBands;
    }

    public struct BakeLevelInfo
    {
        public int Materials, Sounds, Emitters;
        public ulong Triangles;
        public float LowX, LowY, LowZ, HighX, HighY, HighZ;  // bounds of the triangles, in metres
    }

    public enum BakePhase
    {
        Preparing = BakeNative.CLAMOR_BAKE_PREPARING,
        Tracing = BakeNative.CLAMOR_BAKE_TRACING,
        Sorting = BakeNative.CLAMOR_BAKE_SORTING,
        Writing = BakeNative.CLAMOR_BAKE_WRITING
    }

    public struct BakeProgress
    {
        public BakePhase Phase;
        public double Fraction;  // share of the photons that are done
        public ulong Photons, PhotonsTotal, PhotonsReused, Bounces, Escaped;
        public double BouncesPerS, ErrorDb, Seconds;
    }

    // As clamor_bake_options; 0 and null mean the default.
    public sealed class BakeOptions
    {
        public int Threads;
        public long Seed, Photons, Sources, MemoryBytes;
        public double GoalErrorDb, GoalS, SimplifyM, RouletteExponent, LongestPathS;
        public bool NoInstances, Strict;
        public int? EarlyOrder;  // 0 is none, null the default
        public string Journal;

        // Called about ten times a second; false cancels the bake. What it throws cancels the bake,
        // too, and Bake() throws it again.
        public Func<BakeProgress, bool> Progress;

        // Called for each sentence of the report, which is a warning or a note.
        public Action<bool, string> Message;
    }

    public sealed class BakeReport
    {
        public int Warnings;
        public ulong Sources, Photons, PhotonsReused, FileBytes;
        public bool MissedGoal;
        public float ErrorDb;
        public float[] T30S, T30ErrorS;  // eight bands, 63 Hz to 8 kHz; 0: not measured
        public double Seconds;
    }

    // Triangles, materials, sounds and emitters. Only one thread at a time may change a level; several
    // may bake it.
    public sealed class BakeLevel : IDisposable
    {
        // The delegates live as long as the process, because the library calls them by pointers.
        private static readonly BakeNative.ProgressFunction progress = Progress;
        private static readonly BakeNative.MessageFunction message = Message;

        private readonly BakeLevelHandle handle;

        private BakeLevel(IntPtr level)
        {
            handle = new BakeLevelHandle(level);
        }

        // Reads a .gltf or .glb file with its sidecar and sounds.
        public static BakeLevel Read(string path, BakeLevelOptions options = null)
        {
            RequireVersion();
            options = options ?? new BakeLevelOptions();
            var error = new byte[BakeNative.ErrorBytes];
            using (var memory = new NativeMemory()) {
                var given = new BakeNative.clamor_bake_level_options {
                    bytes = BakeNative.clamor_bake_level_options.Size,
                    hidden_meshes = options.HiddenMeshes ? 1u : 0u,
                    acoustics = memory.Text(options.Acoustics), material = memory.Text(options.Material),
                    emitters = memory.Texts(options.Emitters),
                    emitter_count = options.Emitters == null ? 0 : (ulong)options.Emitters.Length };
                IntPtr level;
                ClamorException.Check(BakeNative.clamor_bake_read_level(Context.Utf8(path), ref given,
                    out level, error), error);
                return new BakeLevel(level);
            }
        }

        // Makes an empty level. The bake tells its name.
        public static BakeLevel Create(string name = "level")
        {
            RequireVersion();
            var error = new byte[BakeNative.ErrorBytes];
            IntPtr level;
            ClamorException.Check(
                BakeNative.clamor_bake_create_level(Context.Utf8(name), out level, error), error);
            return new BakeLevel(level);
        }

        private static void RequireVersion()
        {
            if (BakeNative.clamor_bake_abi_version() != BakeNative.CLAMOR_BAKE_ABI_VERSION)
                throw new ClamorException(BakeNative.CLAMOR_BAKE_ERROR_INTERNAL,
                    "libclamor_bake has another ABI version than ClamorBaking.cs; install both of one version");
        }

        public void Dispose()
        {
            handle.Dispose();
        }

        // The names of the material presets.
        public static List<string> Presets
        {
            get {
                var names = new List<string>();
                IntPtr name;
                while ((name = BakeNative.clamor_bake_preset_name((uint)names.Count)) != IntPtr.Zero)
                    names.Add(Marshal.PtrToStringAnsi(name));
                return names;
            }
        }

        // Adds a material and returns its number.
        public int AddMaterial(BakeMaterial values)
        {
            var error = new byte[BakeNative.ErrorBytes];
            using (var memory = new NativeMemory()) {
                var given = new BakeNative.clamor_bake_material {
                    bytes = BakeNative.clamor_bake_material.Size,
                    name = memory.Text(values.Name), preset = memory.Text(values.Preset),
                    absorption = memory.Bands(values.Absorption), scattering = memory.Bands(values.Scattering),
                    phong = memory.Bands(values.Phong), transmission = memory.Bands(values.Transmission) };
                uint material;
                ClamorException.Check(
                    BakeNative.clamor_bake_add_material(handle, ref given, out material, error), error);
                return (int)material;
            }
        }

        // Adds triangles, which reflect on both sides: three floats for each vertex, in metres, and three
        // numbers of vertices for each triangle, or null: the vertices in their order.
        public void AddTriangles(float[] verticesM, int[] indices, int material)
        {
            int corners = indices == null ? verticesM.Length / 3 : indices.Length;
            if (verticesM.Length % 3 != 0 || corners % 3 != 0)
                throw new ArgumentException("vertices have three coordinates, triangles have three vertices");
            var error = new byte[BakeNative.ErrorBytes];
            ClamorException.Check(BakeNative.clamor_bake_add_triangles(handle, verticesM,
                (ulong)(verticesM.Length / 3), indices, (ulong)(corners / 3), (uint)material, error), error);
        }

        // Adds a sound and returns its number.
        public int AddSound(BakeSound values)
        {
            var error = new byte[BakeNative.ErrorBytes];
            using (var memory = new NativeMemory()) {
                var given = new BakeNative.clamor_bake_sound {
                    bytes = BakeNative.clamor_bake_sound.Size, plays_once = values.PlaysOnce ? 1u : 0u,
                    name = memory.Text(values.Name), path = memory.Text(values.Path),
                    samples = memory.Pin(values.Samples),
                    frames = values.Samples == null ? 0 : (ulong)values.Samples.Length,
                    rate_hz = (uint)values.RateHz };
                uint sound;
                ClamorException.Check(
                    BakeNative.clamor_bake_add_sound(handle, ref given, out sound, error), error);
                return (int)sound;
            }
        }

        public void AddEmitter(BakeEmitter values)
        {
            var error = new byte[BakeNative.ErrorBytes];
            using (var memory = new NativeMemory()) {
                var given = new BakeNative.clamor_bake_emitter {
                    bytes = BakeNative.clamor_bake_emitter.Size, sound = (uint)values.Sound,
                    name = memory.Text(values.Name),
                    position_m_0 = values.X, position_m_1 = values.Y, position_m_2 = values.Z,
                    facing_0 = values.FacingX, facing_1 = values.FacingY, facing_2 = values.FacingZ,
                    gain = values.Gain, directivity = values.Directivity,
                    directivity_bands = memory.Bands(values.DirectivityBands), delay_s = values.DelayS };
                ClamorException.Check(
                    BakeNative.clamor_bake_add_emitter(handle, ref given, error), error);
            }
        }

        public void SetAir(double temperatureC = 20, double humidityPercent = 50, double pressureKpa = 101.325)
        {
            var air = new BakeNative.clamor_bake_air {
                bytes = BakeNative.clamor_bake_air.Size, temperature_c = temperatureC,
                humidity_percent = humidityPercent, pressure_kpa = pressureKpa };
            var error = new byte[BakeNative.ErrorBytes];
            ClamorException.Check(BakeNative.clamor_bake_set_air(handle, ref air, error), error);
        }

        public BakeLevelInfo Info
        {
            get {
                var info = new BakeNative.clamor_bake_level_info {
                    bytes = BakeNative.clamor_bake_level_info.Size };
                int code = BakeNative.clamor_bake_get_level_info(handle, ref info);
                if (code != BakeNative.CLAMOR_BAKE_OK)
                    throw new ClamorException(code,
                        Marshal.PtrToStringAnsi(BakeNative.clamor_bake_result_text(code)));
                return new BakeLevelInfo { Materials = (int)info.materials, Sounds = (int)info.sounds,
                    Emitters = (int)info.emitters, Triangles = info.triangles,
                    LowX = info.low_m_0, LowY = info.low_m_1, LowZ = info.low_m_2,
                    HighX = info.high_m_0, HighY = info.high_m_1, HighZ = info.high_m_2 };
            }
        }

        // Bakes into a file, which appears when it is complete and replaces an older one.
        public BakeReport Bake(string path, BakeOptions options = null)
        {
            byte[] bytes;
            return Run(Context.Utf8(path), options ?? new BakeOptions(), out bytes);
        }

        // Bakes into memory: the same bytes, which Context.OpenLevel() takes.
        public BakeReport Bake(out byte[] bytes, BakeOptions options = null)
        {
            return Run(null, options ?? new BakeOptions(), out bytes);
        }

        // What the callbacks of a bake need.
        private sealed class RunningBake
        {
            public BakeOptions Options;
            public ExceptionDispatchInfo Thrown;
        }

        private BakeReport Run(byte[] path, BakeOptions options, out byte[] bytes)
        {
            bytes = null;
            var running = new RunningBake { Options = options };
            GCHandle user = GCHandle.Alloc(running);
            IntPtr baked = IntPtr.Zero;
            try {
                using (var memory = new NativeMemory()) {
                    var given = ToNative(options);
                    given.journal = memory.Text(options.Journal);
                    given.user = GCHandle.ToIntPtr(user);
                    given.progress = Marshal.GetFunctionPointerForDelegate(progress);
                    given.message = Marshal.GetFunctionPointerForDelegate(message);
                    var report = new BakeNative.clamor_bake_report {
                        bytes = BakeNative.clamor_bake_report.Size };
                    var error = new byte[BakeNative.ErrorBytes];
                    ulong count = 0;
                    int code = path != null
                        ? BakeNative.clamor_bake_to_file(handle, ref given, path, ref report, error)
                        : BakeNative.clamor_bake_to_memory(handle, ref given, out baked, out count, ref report,
                            error);
                    if (running.Thrown != null) running.Thrown.Throw();
                    ClamorException.Check(code, error);
                    if (path == null) {
                        bytes = new byte[count];
                        Marshal.Copy(baked, bytes, 0, bytes.Length);
                    }
                    return FromNative(report);
                }
            } finally {
                BakeNative.clamor_bake_free(baked);
                user.Free();
            }
        }

        private static BakeNative.clamor_bake_options ToNative(BakeOptions options)
        {
            return new BakeNative.clamor_bake_options {
                bytes = BakeNative.clamor_bake_options.Size, threads = (uint)options.Threads,
                seed = (ulong)options.Seed, photons = (ulong)options.Photons,
                sources = (ulong)options.Sources, goal_error_db = options.GoalErrorDb,
                goal_s = options.GoalS, simplify_m = options.SimplifyM,
                roulette_exponent = options.RouletteExponent, longest_path_s = options.LongestPathS,
                memory_bytes = (ulong)options.MemoryBytes, no_instances = options.NoInstances ? 1u : 0u,
                strict = options.Strict ? 1u : 0u,
                has_early_order = options.EarlyOrder.HasValue ? 1u : 0u,
                early_order = (uint)options.EarlyOrder.GetValueOrDefault() };
        }

        private static BakeReport FromNative(BakeNative.clamor_bake_report r)
        {
            return new BakeReport {
                Warnings = (int)r.warnings, Sources = r.sources, Photons = r.photons,
                PhotonsReused = r.photons_reused, FileBytes = r.file_bytes,
                MissedGoal = r.missed_goal != 0, ErrorDb = r.error_db, Seconds = r.seconds,
                T30S = new[] { r.t30_s_0, r.t30_s_1, r.t30_s_2, r.t30_s_3, r.t30_s_4, r.t30_s_5, r.t30_s_6,
                    r.t30_s_7 },
                T30ErrorS = new[] { r.t30_error_s_0, r.t30_error_s_1, r.t30_error_s_2, r.t30_error_s_3,
                    r.t30_error_s_4, r.t30_error_s_5, r.t30_error_s_6, r.t30_error_s_7 } };
        }

        [MonoPInvokeCallback(typeof(BakeNative.ProgressFunction))]
        private static int Progress(IntPtr user, ref BakeNative.clamor_bake_progress now)
        {
            var running = (RunningBake)GCHandle.FromIntPtr(user).Target;
            try {
                if (running.Thrown != null) return 1;
                if (running.Options.Progress == null) return 0;
                return running.Options.Progress(new BakeProgress {
                    Phase = (BakePhase)now.phase, Fraction = now.fraction, Photons = now.photons,
                    PhotonsTotal = now.photons_total, PhotonsReused = now.photons_reused,
                    Bounces = now.bounces, Escaped = now.escaped, BouncesPerS = now.bounces_per_s,
                    ErrorDb = now.error_db, Seconds = now.seconds }) ? 0 : 1;
            } catch (Exception exception) {  // no exception can pass through the library
                running.Thrown = ExceptionDispatchInfo.Capture(exception);
                return 1;
            }
        }

        [MonoPInvokeCallback(typeof(BakeNative.MessageFunction))]
        private static void Message(IntPtr user, uint kind, IntPtr sentence)
        {
            var running = (RunningBake)GCHandle.FromIntPtr(user).Target;
            try {
                if (running.Options.Message != null && running.Thrown == null)
                    running.Options.Message(kind == BakeNative.CLAMOR_BAKE_WARNING, NativeText.Read(sentence));
            } catch (Exception exception) {
                running.Thrown = ExceptionDispatchInfo.Capture(exception);
            }
        }
    }

    // Strings and arrays that a call of the library reads; all are given back at the end.
    internal sealed class NativeMemory : IDisposable
    {
        private readonly List<NativeText> texts = new List<NativeText>();
        private readonly List<GCHandle> pinned = new List<GCHandle>();

        public IntPtr Text(string text)
        {
            var copy = new NativeText(text);
            texts.Add(copy);
            return copy.Pointer;
        }

        // The address of an array, which stays where it is; null stays null.
        public IntPtr Pin(Array array)
        {
            if (array == null) return IntPtr.Zero;
            GCHandle handle = GCHandle.Alloc(array, GCHandleType.Pinned);
            pinned.Add(handle);
            return handle.AddrOfPinnedObject();
        }

        public IntPtr Bands(float[] values)
        {
            if (values != null && values.Length != BakeNative.CLAMOR_BAKE_BANDS)
                throw new ArgumentException("there must be a value for each of eight bands");
            return Pin(values);
        }

        public IntPtr Texts(string[] values)
        {
            if (values == null) return IntPtr.Zero;
            var pointers = new IntPtr[values.Length];
            for (int i = 0; i < values.Length; ++i) pointers[i] = Text(values[i]);
            return Pin(pointers);
        }

        public void Dispose()
        {
            foreach (NativeText text in texts) text.Dispose();
            foreach (GCHandle handle in pinned) handle.Free();
        }
    }
}

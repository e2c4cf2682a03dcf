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
        // Metres between places where moving sources are heard with reflections; -1: as many as suit the level.
        public double ProbeSpacingM;
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

        private readonly NativeHandle handle;

        private BakeLevel(IntPtr level) =>
            handle = new NativeHandle(level, pointer => BakeNative.clamor_bake_destroy_level(pointer));

        // Reads a .gltf or .glb file with its sidecar and sounds.
        public static BakeLevel Read(string path, BakeLevelOptions options = null)
        {
            RequireVersion();
            options = options ?? new BakeLevelOptions();
            using (var memory = new NativeMemory())
                return new BakeLevel(BakeNative.ReadLevel(path, new BakeNative.clamor_bake_level_options {
                    hidden_meshes = options.HiddenMeshes ? 1u : 0u,
                    acoustics = memory.Text(options.Acoustics), material = memory.Text(options.Material),
                    emitters = memory.Texts(options.Emitters),
                    emitter_count = options.Emitters == null ? 0 : (ulong)options.Emitters.Length }));
        }

        // Makes an empty level. The bake tells its name.
        public static BakeLevel Create(string name = "level")
        {
            RequireVersion();
            return new BakeLevel(BakeNative.CreateLevel(name));
        }

        private static void RequireVersion()
        {
            if (BakeNative.clamor_bake_abi_version() != BakeNative.CLAMOR_BAKE_ABI_VERSION)
                throw new ClamorException(BakeNative.CLAMOR_BAKE_ERROR_INTERNAL,
                    "libclamor_bake has another ABI version than ClamorBaking.cs; install both of one version");
        }

        public void Dispose() => handle.Dispose();

        // The names of the material presets.
        public static List<string> Presets
        {
            get {
                var names = new List<string>();
                IntPtr name;
                while ((name = BakeNative.clamor_bake_preset_name((uint)names.Count)) != IntPtr.Zero)
                    names.Add(NativeMemory.Read(name));
                return names;
            }
        }

        // Adds a material and returns its number.
        public int AddMaterial(BakeMaterial values)
        {
            using (var memory = new NativeMemory())
                return (int)BakeNative.AddMaterial(handle, new BakeNative.clamor_bake_material {
                    name = memory.Text(values.Name), preset = memory.Text(values.Preset),
                    absorption = memory.Bands(values.Absorption), scattering = memory.Bands(values.Scattering),
                    phong = memory.Bands(values.Phong), transmission = memory.Bands(values.Transmission) });
        }

        // Adds triangles, which reflect on both sides: three floats for each vertex, in metres, and three
        // numbers of vertices for each triangle, or null: the vertices in their order.
        public void AddTriangles(float[] verticesM, int[] indices, int material)
        {
            int corners = indices == null ? verticesM.Length / 3 : indices.Length;
            if (verticesM.Length % 3 != 0 || corners % 3 != 0)
                throw new ArgumentException("vertices have three coordinates, triangles have three vertices");
            BakeNative.AddTriangles(handle, verticesM, (ulong)(verticesM.Length / 3), indices,
                (ulong)(corners / 3), (uint)material);
        }

        // Adds a sound and returns its number.
        public int AddSound(BakeSound values)
        {
            using (var memory = new NativeMemory())
                return (int)BakeNative.AddSound(handle, new BakeNative.clamor_bake_sound {
                    plays_once = values.PlaysOnce ? 1u : 0u, name = memory.Text(values.Name),
                    path = memory.Text(values.Path), samples = memory.Pin(values.Samples),
                    frames = values.Samples == null ? 0 : (ulong)values.Samples.Length,
                    rate_hz = (uint)values.RateHz });
        }

        public void AddEmitter(BakeEmitter values)
        {
            using (var memory = new NativeMemory())
                BakeNative.AddEmitter(handle, new BakeNative.clamor_bake_emitter {
                    sound = (uint)values.Sound, name = memory.Text(values.Name),
                    position_m = new Doubles3(values.X, values.Y, values.Z),
                    facing = new Doubles3(values.FacingX, values.FacingY, values.FacingZ),
                    gain = values.Gain, directivity = values.Directivity,
                    directivity_bands = memory.Bands(values.DirectivityBands), delay_s = values.DelayS });
        }

        public void SetAir(double temperatureC = 20, double humidityPercent = 50, double pressureKpa = 101.325) =>
            BakeNative.SetAir(handle, new BakeNative.clamor_bake_air { temperature_c = temperatureC,
                humidity_percent = humidityPercent, pressure_kpa = pressureKpa });

        public BakeLevelInfo Info
        {
            get {
                var info = BakeNative.GetLevelInfo(handle);
                return new BakeLevelInfo { Materials = (int)info.materials, Sounds = (int)info.sounds,
                    Emitters = (int)info.emitters, Triangles = info.triangles,
                    LowX = info.low_m._0, LowY = info.low_m._1, LowZ = info.low_m._2,
                    HighX = info.high_m._0, HighY = info.high_m._1, HighZ = info.high_m._2 };
            }
        }

        // Bakes into a file, which appears when it is complete and replaces an older one.
        public BakeReport Bake(string path, BakeOptions options = null)
        {
            byte[] bytes;
            return Run(path, options ?? new BakeOptions(), out bytes);
        }

        // Bakes into memory: the same bytes, which Context.OpenLevel() takes.
        public BakeReport Bake(out byte[] bytes, BakeOptions options = null) =>
            Run(null, options ?? new BakeOptions(), out bytes);

        // What the callbacks of a bake need.
        private sealed class RunningBake
        {
            public BakeOptions Options;
            public ExceptionDispatchInfo Thrown;
        }

        private BakeReport Run(string path, BakeOptions options, out byte[] bytes)
        {
            bytes = null;
            var running = new RunningBake { Options = options };
            GCHandle user = GCHandle.Alloc(running);
            IntPtr baked = IntPtr.Zero;
            try {
                using (var memory = new NativeMemory()) {
                    var given = new BakeNative.clamor_bake_options {
                        threads = (uint)options.Threads, seed = (ulong)options.Seed,
                        photons = (ulong)options.Photons, sources = (ulong)options.Sources,
                        goal_error_db = options.GoalErrorDb, goal_s = options.GoalS,
                        simplify_m = options.SimplifyM, roulette_exponent = options.RouletteExponent,
                        longest_path_s = options.LongestPathS, memory_bytes = (ulong)options.MemoryBytes,
                        no_instances = options.NoInstances ? 1u : 0u, strict = options.Strict ? 1u : 0u,
                        has_early_order = options.EarlyOrder.HasValue ? 1u : 0u,
                        early_order = (uint)options.EarlyOrder.GetValueOrDefault(),
                        probe_spacing_m = options.ProbeSpacingM,
                        journal = memory.Text(options.Journal), user = GCHandle.ToIntPtr(user),
                        progress = Marshal.GetFunctionPointerForDelegate(progress),
                        message = Marshal.GetFunctionPointerForDelegate(message) };
                    if (path != null) return FromNative(BakeNative.ToFile(handle, given, path), running);
                    BakeNative.ToMemory(handle, given, out baked, out ulong count,
                        out BakeNative.clamor_bake_report report);
                    bytes = new byte[count];
                    Marshal.Copy(baked, bytes, 0, bytes.Length);
                    return FromNative(report, running);
                }
            } catch (ClamorException) when (running.Thrown != null) {
                running.Thrown.Throw();
                throw;  // is not reached
            } finally {
                BakeNative.clamor_bake_free(baked);
                user.Free();
            }
        }

        private static BakeReport FromNative(BakeNative.clamor_bake_report r, RunningBake running)
        {
            if (running.Thrown != null) running.Thrown.Throw();
            return new BakeReport {
                Warnings = (int)r.warnings, Sources = r.sources, Photons = r.photons,
                PhotonsReused = r.photons_reused, FileBytes = r.file_bytes,
                MissedGoal = r.missed_goal != 0, ErrorDb = r.error_db, Seconds = r.seconds,
                T30S = r.t30_s.ToArray(), T30ErrorS = r.t30_error_s.ToArray() };
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
                    running.Options.Message(kind == BakeNative.CLAMOR_BAKE_WARNING, NativeMemory.Read(sentence));
            } catch (Exception exception) {
                running.Thrown = ExceptionDispatchInfo.Capture(exception);
            }
        }
    }
}

// csharp_binding.cs: checks of Clamor.cs that csharp_binding_test.cpp runs: CHECK ARGUMENT...
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;
using Clamor;

static class CSharpBinding
{
    static int Main(string[] words)
    {
        if (words[0] == "interface")
            Interface(words[1] == "clamor_bake" ? typeof(BakeNative) : typeof(Native), words[1], words[2]);
        if (words[0] == "allocations") Allocations(words[1]);
        if (words[0] == "sources") Sources(words[1]);
        if (words[0] == "pull") Pull(words[1]);
        if (words[0] == "doors") Doors(words[1]);
        if (words[0] == "bake") Bake(words[1], words[2], words[3]);
        if (words[0] == "use") Use(words[1]);
        return 0;
    }

    static void Require(bool holds, string what)
    {
        if (!holds) throw new Exception(what);
    }

    // The word of header_table.h for a type.
    static string Kind(Type type)
    {
        if (type == typeof(void)) return "v";
        if (type.IsByRef || type.IsArray || type == typeof(IntPtr) || type.IsSubclassOf(typeof(SafeHandle)))
            return "p";
        if (type == typeof(float) || type == typeof(double)) return "f" + Marshal.SizeOf(type);
        Require(type == typeof(int) || type == typeof(uint) || type == typeof(ulong), "no kind: " + type);
        return (type == typeof(int) ? "i" : "u") + Marshal.SizeOf(type);
    }

    static void AddStructure(Type type, SortedSet<string> lines)
    {
        int size = Marshal.SizeOf(type);
        lines.Add("struct " + type.Name + " " + size);
        Require((uint)type.GetField("Size").GetValue(null) == size, type + ".Size");
        GCHandle.Alloc(Activator.CreateInstance(type), GCHandleType.Pinned).Free();  // only if blittable
        foreach (FieldInfo field in type.GetFields(BindingFlags.Public | BindingFlags.Instance))
            lines.Add("member " + type.Name + " " + field.Name + " " + Marshal.OffsetOf(type, field.Name) + " " +
                Marshal.SizeOf(field.FieldType));
    }

    // A structure of the application's is laid out as one of the header: numbers of eight bytes without gaps,
    // and the arrays begin with the members that are given.
    static void AddPublicStructure(Type type, string name, SortedSet<string> lines, params string[] arrays)
    {
        int size = Marshal.SizeOf(type);
        lines.Add("struct " + name + " " + size);
        Require(size == 8 * type.GetFields(BindingFlags.Public | BindingFlags.Instance).Length, type + " has gaps");
        for (int i = 0; i < arrays.Length; i += 2) {
            int begin = Marshal.OffsetOf(type, arrays[i + 1]).ToInt32();
            int end = i + 3 < arrays.Length ? Marshal.OffsetOf(type, arrays[i + 3]).ToInt32() : size;
            lines.Add("member " + name + " " + arrays[i] + " " + begin + " " + (end - begin));
        }
    }

    // A class declares all of a header, PREFIX.h, with its values, sizes, offsets and types.
    static void Interface(Type native, string prefix, string table)
    {
        var declared = new SortedSet<string>();
        var all = BindingFlags.Public | BindingFlags.Static;
        foreach (FieldInfo field in native.GetFields(all))
            if (field.FieldType == typeof(int) && field.Name.StartsWith("CLAMOR_"))
                declared.Add("constant " + field.Name + " " + field.GetRawConstantValue());
        foreach (Type type in native.GetNestedTypes())
            if (type.IsValueType) AddStructure(type, declared);
        if (native == typeof(Native)) {
            AddPublicStructure(typeof(Pose), "clamor_pose", declared, "position_m", "X", "orientation", "QuaternionX");
            AddPublicStructure(typeof(Motion), "clamor_motion", declared, "position_m", "X", "velocity_mps",
                "VelocityX", "axis", "AxisX");
        }
        int errorBytes = (int)native.GetField("ErrorBytes").GetRawConstantValue();
        declared.Add("struct " + prefix + "_error " + errorBytes);
        declared.Add("member " + prefix + "_error code 0 4");
        declared.Add("member " + prefix + "_error sentence 4 " + (errorBytes - 4));
        foreach (MethodInfo method in native.GetMethods(all)) {
            if (!method.Name.StartsWith("clamor_")) continue;
            string line = "function " + method.Name + " " + Kind(method.ReturnType);
            foreach (ParameterInfo parameter in method.GetParameters())
                line += " " + Kind(parameter.ParameterType);
            declared.Add(line);
        }
        var header = new SortedSet<string>();
        foreach (string line in File.ReadAllLines(table)) header.Add(line);
        foreach (string line in header)
            if (!declared.Contains(line)) Console.WriteLine("the header has, and the class has not: " + line);
        foreach (string line in declared)
            if (!header.Contains(line)) Console.WriteLine("the class has, and the header has not: " + line);
        Require(header.Count > 50 && header.SetEquals(declared), "the declarations differ");
    }

    static Listener Cheap(Context clamor, Level level, bool offline = false)
    {
        return clamor.CreateListener(level, new ListenerOptions {
            Output = Output.Receivers, Voices = 20, Offline = offline, Pose = new Pose(0, 1.7, 3) });
    }

    // The managed memory that this thread allocates meanwhile, in bytes.
    static long Allocated(Action act)
    {
        long before = GC.GetAllocatedBytesForCurrentThread();
        act();
        return GC.GetAllocatedBytesForCurrentThread() - before;
    }

    public static byte[] Kept;

    // A thousand calls of Render() allocate no managed memory; a byte[8] in each would be seen.
    static void Allocations(string path)
    {
        using (var clamor = new Context())
        using (var level = clamor.OpenLevel(path))
        using (var ears = Cheap(clamor, level)) {
            var samples = new float[128];
            int errors = 0;
            Action render = () => {
                for (int i = 0; i < 1000; ++i) errors += ears.Render(samples, 64, 32);
            };
            Action allocate = () => {
                for (int i = 0; i < 1000; ++i) Kept = new byte[8];
            };
            Allocated(render);  // compiles it
            long rendering = Allocated(render), allocating = Allocated(allocate);
            Console.WriteLine("1000 calls: " + rendering + " bytes; with byte[8] in each: " + allocating);
            Require(errors == 0, "Render() failed");
            Require(rendering == 0, "Render() allocates");
            Require(allocating > 1000, "the measure sees nothing");
        }
    }

    sealed class Archive : ILevelReader
    {
        public readonly byte[] Bytes;
        public bool Fails;
        public int Reads;

        public Archive(byte[] bytes)
        {
            Bytes = bytes;
        }

        public ulong Size
        {
            get { return (ulong)Bytes.Length; }
        }

        public void Read(ulong offset, ulong count, IntPtr into)
        {
            if (Fails) throw new IOException("no disk");
            Interlocked.Increment(ref Reads);
            Marshal.Copy(Bytes, (int)offset, into, (int)count);
        }
    }

    static int CodeOf(Action act)
    {
        try {
            act();
        } catch (ClamorException exception) {
            Console.WriteLine(exception.Message);
            return exception.Code;
        }
        return 0;
    }

    static float Peak(Context clamor, Level level)
    {
        using (var ears = Cheap(clamor, level, true)) return Peak(clamor, ears);
    }

    static float Peak(Context clamor, Listener ears)
    {
        var samples = new float[960];
        float peak = 0;
        for (int i = 0; i < 20; ++i) {
            clamor.Update(0.1);
            Require(ears.Render(samples, 0, 480) == 0, "Render() failed");
            foreach (float sample in samples) peak = Math.Max(peak, sample);
        }
        return peak;
    }

    // Whether what is heard gets there. In real time it depends on the machine when a change is heard.
    static bool Becomes(Context clamor, Listener ears, Func<float, bool> isReached)
    {
        for (int i = 0; i < 100; ++i)
            if (isReached(Peak(clamor, ears))) return true;
        return false;
    }

    // The direction in which a pose looks: the -Z axis, rotated.
    static double[] Ahead(Pose p)
    {
        double x = p.QuaternionX, y = p.QuaternionY, z = p.QuaternionZ, w = p.QuaternionW;
        return new[] { -2 * (x * z + w * y), -2 * (y * z - w * x), 2 * (x * x + y * y) - 1 };
    }

    static bool Ahead(Pose pose, double x)
    {
        return Math.Abs(Ahead(pose)[0] - x) < 1e-9;
    }

    // The application's own sounds, streams, groups and sources.
    static void Sources(string path)
    {
        var tone = new float[4800];
        for (int i = 0; i < tone.Length; ++i) tone[i] = (float)Math.Sin(i * Math.PI / 24);
        using (var clamor = new Context(true))
        using (var level = clamor.OpenLevel(path))
        using (var sound = new Sound(clamor, tone, 48000, true))
        using (var stream = new StreamedSound(clamor))
        using (var group = new Group(clamor))
        using (var ears = clamor.CreateListener(level, new ListenerOptions {
            Output = Output.Receivers, Voices = 20, Pose = new Pose(0, 1.7, 3), ReportsVoices = true })) {
            var options = new SourceOptions { Sound = sound, Group = group, Gain = 1000,
                Motion = new Motion { Y = 1.7, Z = 1.5 } };
            var source = new Source(clamor, options);
            Require(Peak(clamor, ears) < 100, "begins before the commit");
            clamor.Commit();
            Require(Becomes(clamor, ears, peak => peak > 100), "the source is not heard");
            var voices = new Voice[100];
            double timeS;
            int count = ears.GetVoices(voices, out timeS), own = 0;
            for (int i = 0; i < count; ++i)
                if (voices[i].LevelSound < 0 && voices[i].Z < -0.999f && voices[i].Gain1kHz > 100) ++own;
            Require(own == 1 && timeS > 0, "voices");
            group.Change(isMuted: true);
            clamor.Commit();
            Require(Becomes(clamor, ears, peak => peak < 100), "the group is not mute");
            source.Change(new SourceOptions { Sound = stream, Gain = 1000 });
            source.Move(new Motion { Y = 1.7, Z = 1.5 });
            Require(stream.Write(tone, 0, tone.Length) == tone.Length, "Write()");
            long allocated = Allocated(() => {
                for (int i = 0; i < 100; ++i) stream.Write(tone, 0, 16);
            });
            Require(allocated == 0, "Write() allocates");
            clamor.Commit();
            Require(Becomes(clamor, ears, peak => peak > 100), "the stream is not heard");
            source.Dispose();
            Require(CodeOf(() => source.Move(new Motion())) == -2, "a source that is disposed of");
        }
        Emitters(path);
    }

    // An emitter that is muted is no longer heard; what cannot be read any more is told.
    static void Emitters(string path)
    {
        var told = new List<string>();
        var archive = new Archive(File.ReadAllBytes(path));
        using (var clamor = new Context(true, 0, told.Add))
        using (var level = clamor.OpenLevel(archive, "the archive"))
        using (var ears = Cheap(clamor, level)) {
            EmitterInfo emitter = level.Emitter(0);
            Require(level.FindEmitter(emitter.Name) == 0 && level.FindEmitter("nobody") == -1, "FindEmitter()");
            Require(emitter.Gain > 0 && Becomes(clamor, ears, peak => peak > 1e-6), "the emitter is not heard");
            level.ChangeEmitter(0, isMuted: true);
            clamor.Commit();
            Require(Becomes(clamor, ears, peak => peak < 1e-9), "the emitter is not mute");
            Require(told.Count == 0, "something is told");
            using (var late = Cheap(clamor, level)) {
                archive.Fails = true;
                Peak(clamor, late);
            }
            Require(told.Count > 0 && told[0].Contains("the archive"), "nothing is told");
        }
    }

    // The power of the last quarter of the next half second of an offline listener.
    static double Power(Context clamor, Listener ears)
    {
        var block = new float[960];
        double sum = 0;
        for (int i = 0; i < 50; ++i) {
            double timeS;
            while (ears.WantsKeyframe(out timeS)) {
                clamor.Commit(timeS);
                clamor.Update();
            }
            Require(ears.Render(block, 0, 480) == 0, "Render() failed");
            if (i < 25) continue;
            foreach (float sample in block) sum += sample * sample;
        }
        return sum;
    }

    // A source behind the door of a level: the door and its portal, a board of the application's, and
    // the reverberation of the source.
    static void Doors(string path)
    {
        var tone = new float[4800];
        for (int i = 0; i < tone.Length; ++i) tone[i] = (float)Math.Sin(i * Math.PI / 24);
        using (var clamor = new Context(true))
        using (var level = clamor.OpenLevel(path))
        using (var sound = new Sound(clamor, tone, 48000, true))
        using (var ears = clamor.CreateListener(level, new ListenerOptions {
            Output = Output.Receivers, Offline = true, Pose = new Pose(4, 1.6, 7) })) {
            Func<double?, SourceOptions> withReverberation = reverberation => new SourceOptions { Sound = sound,
                Motion = new Motion { X = 4, Y = 1.6, Z = 3 }, Reverberation = reverberation };
            var source = new Source(clamor, withReverberation(null));
            Part door = level.FindPart("Door");
            Require(level.Info.Parts == 1 && level.FindPart("Gate") == null, "FindPart()");
            Require(CodeOf(() => level.Part(1)) == -1, "a part that is not there");
            PartInfo info = level.Part(0).Info;
            Require(info.Name == "Door" && info.Triangles == 12 && info.IsEnabled, "info of a part");
            Require(info.Pose.Z == 4.5 && info.Pose.QuaternionW == 1, "pose of a part");
            int portal = level.FindPortal("Door");
            PortalInfo opening = level.Portal(portal);
            Require(opening.Name == "Door" && opening.CentreM[2] == 4.5, "info of a portal");
            Require(opening.HalfUM[0] == 0.6 && opening.HalfVM[1] == 2, "rectangle of a portal");
            level.SetPortal(portal, 0);
            double closed = Power(clamor, ears);
            door.Move(new Pose(3.4, 0, 4.5, 0, 1, 0, 1));
            double openDoor = Power(clamor, ears);
            level.SetPortal(portal, 1);
            double open = Power(clamor, ears);
            Require(openDoor > 100 * closed && open != openDoor, "the door");
            door.Move(info.Pose);
            door.Enable(false);
            Require(!door.Info.IsEnabled, "a part that is disabled");
            door.Dispose();
            Require(CodeOf(() => door.Enable(true)) == -2 && level.Part(0).Info.Triangles == 12, "a part stays");

            double whole = Power(clamor, ears);
            source.Change(withReverberation(0));
            double direct = Power(clamor, ears);
            source.Change(withReverberation(10));
            Require(Power(clamor, ears) > 10 * whole && Math.Abs(whole - direct) > 0.05 * direct, "reverberation");
            foreach (double hostile in new[] { -1, double.NaN, double.PositiveInfinity, 1e7 })
                Require(CodeOf(() => source.Change(withReverberation(hostile))) == -1, "reverberation out of range");
            source.Change(withReverberation(0));
            Boards(clamor, ears, Power(clamor, ears));
        }
    }

    // A box and a mesh between a listener and what is heard with a power.
    static void Boards(Context clamor, Listener ears, double power)
    {
        var box = new PartOptions { HalfX = 20, HalfY = 20, HalfZ = 0.02, Pose = new Pose(3.4, 0, 4.5) };
        var mesh = new PartOptions { VerticesM = new float[] { -20, -20, 0, 20, -20, 0, 20, 20, 0, -20, 20, 0 },
            Indices = new[] { 0, 1, 2, 0, 2, 3 }, Pose = new Pose(3.4, 0, 4.5) };
        foreach (PartOptions options in new[] { box, mesh }) {
            options.Transmission = 0;
            var board = new Part(clamor, options);
            GC.Collect();
            Require(board.Info.Name == "" && Power(clamor, ears) < 0.01 * power, "a board");
            board.Dispose();
            Require(Math.Abs(Power(clamor, ears) / power - 1) < 0.01, "a board that is removed");
            options.Transmission = 2;
            Require(CodeOf(() => new Part(clamor, options)) == -1, "transmission out of range");
            options.Transmission = 0;
            options.BandScatterings = new double[] { 0, 0, 0, 0, 0, 0, 0, 2 };
            Require(CodeOf(() => new Part(clamor, options)) == -1, "scattering out of range");
        }
        var ended = false;
        try {
            new Part(clamor, new PartOptions { VerticesM = new float[3] });
        } catch (ArgumentException) {
            ended = true;
        }
        Require(ended, "a mesh without indices");
    }

    // What is heard over headphones of sounds that begin one after the other, each a second later.
    static float[] Heard(Context clamor, Level level, params Sound[] sounds)
    {
        var heard = new float[2 * 48000 * sounds.Length];
        using (var ears = clamor.CreateListener(level, new ListenerOptions { Voices = 20, Offline = true })) {
            int begun = 0;
            for (int done = 0; done < heard.Length / 2; done += 480) {
                double timeS;
                while (ears.WantsKeyframe(out timeS)) {
                    if (begun < sounds.Length && timeS > begun - 0.01)
                        new Source(clamor, new SourceOptions { Sound = sounds[begun++],
                            Motion = new Motion { X = 1, Z = -3 } });
                    clamor.Commit(timeS);
                    clamor.Update();
                }
                Require(ears.Render(heard, 2 * done, 480) == 0, "Render() failed");
            }
        }
        return heard;
    }

    static double Rms(Func<int, double> sample, int count)
    {
        double sum = 0;
        for (int i = 0; i < count; ++i) sum += sample(i) * sample(i);
        return Math.Sqrt(sum / count);
    }

    // A stream with a function sounds like the samples that the function brings, and is silent where the
    // function throws.
    static void Pull(string path)
    {
        var noise = new float[20000];
        for (int i = 0; i < noise.Length; ++i) noise[i] = (float)(Math.Sin(1e-4 * ((long)i * i % 99991) * 0.37) / 4);
        int pulled = 0, calls = 0;
        PullFunction bring = (samples, frames) => {
            int count = Math.Min(frames, noise.Length - pulled);
            Array.Copy(noise, pulled, samples, 0, count);
            pulled += count;
            GC.Collect();
            return count;
        };
        PullFunction fail = (samples, frames) => {
            ++calls;
            throw new InvalidOperationException("no voice");
        };
        using (var clamor = new Context(true))
        using (var level = clamor.OpenLevel(path))
        using (var failing = new PulledSound(clamor, fail)) {
            float[] heard = Heard(clamor, level, new Sound(clamor, noise), new PulledSound(clamor, bring), failing);
            int second = 2 * 48000;
            double expected = Rms(i => heard[i], second / 2);
            double difference = Rms(i => heard[second + i] - heard[i], second / 2);
            double silence = Rms(i => heard[2 * second + i], second / 2);
            Console.WriteLine("rms " + expected + ", difference " + difference + ", silence " + silence);
            Require(pulled == noise.Length && expected > 0.01, "the sound is not heard");
            Require(difference < 1e-3 * expected, "the stream sounds differently");  // as delays are floats
            Require(silence < 1e-6, "a function that throws is not silent");
            Require(calls > 1 && failing.Failure.Message == "no voice", "Failure");
        }

        // Threads of the library pull while the stream and its context are disposed of.
        for (int i = 0; i < 3; ++i) {
            var context = new Context();
            var level = context.OpenLevel(path);
            var ears = Cheap(context, level);
            long sum = 0;
            var sound = new PulledSound(context, (samples, frames) => frames + 0 * (int)(sum += frames));
            new Source(context, new SourceOptions { Sound = sound });
            context.Commit();
            var block = new float[960];
            while (Interlocked.Read(ref sum) == 0) ears.Render(block, 0, 480);
            sound.Dispose();
            if (i > 0) context.Commit();
            for (int k = 0; k < 10 * i; ++k) ears.Render(block, 0, 480);
            context.Dispose();
        }
    }

    // Bakes have the bytes of `clamor bake`; triangles of arrays, progress, cancelling and errors.
    static void Bake(string gltf, string baked, string folder)
    {
        byte[] theirs = File.ReadAllBytes(baked), bytes;
        string path = folder + "/level.clamor";
        var last = new BakeProgress();
        int notes = 0;
        using (var level = BakeLevel.Read(gltf)) {
            var options = new BakeOptions { Photons = 300, Sources = 1000 };
            options.Progress = now => { last = now; GC.Collect(); return true; };
            options.Message = (isWarning, sentence) => notes += sentence.Length > 10 ? 1 : 0;
            BakeReport report = level.Bake(path, options);
            Require(Same(File.ReadAllBytes(path), theirs), "the file is another");
            Require(report.Photons == 300 && report.FileBytes == (ulong)theirs.Length, "report");
            Require(report.T30S.Length == 8 && notes > 0 && last.PhotonsTotal == 300, "callbacks");
            level.Bake(out bytes, options);
            Require(Same(bytes, theirs), "the bytes are others");
            Require(level.Info.Emitters == 1 && level.Info.Triangles > 100, "info");
        }
        using (var room = BakeLevel.Create("box")) {
            var absorption = new[] { 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f };
            int wall = room.AddMaterial(new BakeMaterial { Name = "wall", Absorption = absorption });
            room.AddTriangles(Corners(6, 3, 8), Box, wall);
            var noise = new float[44100];
            for (int i = 0; i < noise.Length; ++i) noise[i] = (i * 7919L % 1009 - 504) / 5040f;
            int sound = room.AddSound(new BakeSound { Name = "noise", Samples = noise, RateHz = 44100 });
            room.AddEmitter(new BakeEmitter { Sound = sound, X = 2, Y = 1.2, Z = 3, Directivity = 1 });
            BakeLevelInfo info = room.Info;
            Require(info.Triangles == 12 && info.Materials == 1 && info.LowX == -3 && info.HighZ == 8, "info");

            var endless = new BakeOptions { Photons = 100000000, Progress = now => false };
            Require(CodeOf(() => room.Bake(path, endless)) == -10, "cancelled");
            Require(Same(File.ReadAllBytes(path), theirs), "a bake that is cancelled leaves the file");
            endless.Progress = now => { throw new InvalidOperationException("stop"); };
            string thrown = null;
            try {
                room.Bake(path, endless);
            } catch (InvalidOperationException exception) {
                thrown = exception.Message;
            }
            Require(thrown == "stop", "what a callback throws");
            Require(CodeOf(() => room.AddMaterial(new BakeMaterial { Preset = "plastr" })) == -1, "preset");
            Require(CodeOf(() => room.AddTriangles(Corners(1, 1, 1), new[] { 0, 1, 8 }, wall)) == -1, "vertex");
            Require(CodeOf(() => room.AddSound(new BakeSound { Path = folder + "/none.wav" })) == -3, "file");
            Require(BakeLevel.Presets.Contains("plaster"), "presets");
            Require(CodeOf(() => room.Bake(path, new BakeOptions { EarlyOrder = 4 })) == -1, "order");
            Require(CodeOf(() => room.Bake(path, new BakeOptions { EarlyOrder = -1 })) == -1, "order");
            byte[] without;
            room.Bake(out without, new BakeOptions { Photons = 1000, Sources = 1000, EarlyOrder = 0 });
            room.Bake(out bytes, new BakeOptions { Photons = 1000, Sources = 1000 });
            Require(!Same(bytes, without), "none is another order than the default");
        }
        Require(CodeOf(() => BakeLevel.Read(folder + "/none.glb")) == -3, "no such level");
        using (var clamor = new Context(true))
        using (var level = clamor.OpenLevel(bytes, "box"))
            Require(level.Info.Emitters == 1 && Peak(clamor, level) > 0.001f, "the box is not heard");
    }

    static bool Same(byte[] a, byte[] b)
    {
        if (a.Length != b.Length) return false;
        for (int i = 0; i < a.Length; ++i)
            if (a[i] != b[i]) return false;
        return true;
    }

    // The corners of a box about the Z axis, whose number has a bit for each axis, and its triangles.
    static float[] Corners(float x, float y, float z)
    {
        var corners = new float[24];
        for (int i = 0; i < 8; ++i) {
            corners[3 * i] = ((i & 1) - 0.5f) * x;
            corners[3 * i + 1] = (i >> 1 & 1) * y;
            corners[3 * i + 2] = (i >> 2 & 1) * z;
        }
        return corners;
    }

    static readonly int[] Box = {
        0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3 };

    // Levels from files, memory and an archive; errors; what is rendered while all is disposed of.
    static void Use(string path)
    {
        byte[] bytes = File.ReadAllBytes(path);
        var archive = new Archive(bytes);
        var clamor = new Context(true);
        using (var file = clamor.OpenLevel(path))
        using (var memory = clamor.OpenLevel(bytes, "memory"))
        using (var other = clamor.OpenLevel(archive, "archive")) {
            float peak = Peak(clamor, file);
            Require(peak > 0.001f && Peak(clamor, memory) == peak && Peak(clamor, other) == peak, "peaks");
            Require(archive.Reads > 0 && file.Info.Emitters == 1 && file.Info.Sounds == 1, "info");
        }
        archive.Fails = true;
        Require(CodeOf(() => clamor.OpenLevel(archive, "archive")) == -3, "a reader that throws");
        Require(CodeOf(() => clamor.OpenLevel("no such file")) == -3, "no such file");
        var level = clamor.OpenLevel(path);
        Require(CodeOf(() => clamor.CreateListener(level, new ListenerOptions { RateHz = 7 })) == -1, "rate");
        var ears = Cheap(clamor, level);
        var block = new float[10];
        Require(ears.Channels == 2 && ears.Statistics.Failures == 0, "statistics");
        Require(ears.Render(block, 1, 5) == -1 && ears.Render(null, 0, 1) == -1, "ranges");
        double s = Math.Sqrt(0.5);  // Unity's quarter turn to the right, after which it looks along +X
        Pose turned = Pose.FromInvertedX(1, 2, 3, 0, s, 0, s);
        Require(turned.X == -1 && Ahead(turned, -1) && Ahead(Pose.FromInvertedZ(1, 2, 3, 0, s, 0, s), 1), "turns");
        Pose tilted = Pose.FromInvertedX(1, 2, 3, -0.6, 0, 0, 0.8);  // Unity: looks up
        Require(Math.Abs(Ahead(tilted)[1] - 0.96) < 1e-9, "tilts up");
        Require(Math.Abs(Ahead(Pose.FromInvertedZ(0, 0, 0, -0.6, 0, 0, 0.8))[1] - 0.96) < 1e-9, "tilts up");
        ears.Move(turned);
        Require(CodeOf(() => ears.Move(new Pose(double.NaN, 0, 0))) == -1, "not a number");

        bool stop = false;
        var audio = new Thread(() => {
            while (!Volatile.Read(ref stop)) ears.Render(block, 0, 5);
        });
        audio.Start();
        Thread.Sleep(20);
        clamor.Dispose();
        ears.Dispose();
        level.Dispose();
        Volatile.Write(ref stop, true);
        audio.Join();
        Require(ears.Render(block, 0, 5) == -7, "a listener of a disposed context");
    }
}

// csharp_binding.cs: checks of Clamor.cs that csharp_binding_test.cpp runs: CHECK ARGUMENT...
// Those of what is heard are in csharp_binding_sounds.cs.
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;
using Clamor;

static partial class CSharpBinding
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
            room.Bake(out without, new BakeOptions { Photons = 1000, Sources = 1000, ProbeSpacingM = 2 });
            Require(!Same(bytes, without), "probes are in the file");
            Require(CodeOf(() => room.Bake(path, new BakeOptions { ProbeSpacingM = -2 })) == -1, "spacing");
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

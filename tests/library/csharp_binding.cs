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
        if (words[0] == "interface") Interface(words[1]);
        if (words[0] == "allocations") Allocations(words[1]);
        if (words[0] == "sources") Sources(words[1]);
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
        Require((uint)type.GetField("Size").GetRawConstantValue() == size, type + ".Size");
        GCHandle.Alloc(Activator.CreateInstance(type), GCHandleType.Pinned).Free();  // only if blittable
        var places = new Dictionary<string, int[]>();
        foreach (FieldInfo field in type.GetFields(BindingFlags.Public | BindingFlags.Instance)) {
            string name = field.Name;
            int offset = Marshal.OffsetOf(type, name).ToInt32(), bytes = Marshal.SizeOf(field.FieldType);
            int digits = name.Length;
            while (char.IsDigit(name[digits - 1])) --digits;
            if (digits < name.Length && name[digits - 1] == '_') {
                string array = name.Substring(0, digits - 1);
                int[] known;
                if (places.TryGetValue(array, out known)) {
                    Require(known[0] + known[1] == offset, "a gap before " + name);
                    known[1] += bytes;
                    continue;
                }
                name = array;
            }
            places.Add(name, new[] { offset, bytes });
        }
        foreach (var place in places)
            lines.Add("member " + type.Name + " " + place.Key + " " + place.Value[0] + " " + place.Value[1]);
    }

    // Clamor.cs declares all of a header, with its values, sizes, offsets and types.
    static void Interface(string table)
    {
        var declared = new SortedSet<string>();
        var all = BindingFlags.Public | BindingFlags.Static;
        foreach (FieldInfo field in typeof(Native).GetFields(all))
            if (field.IsLiteral && field.Name.StartsWith("CLAMOR_"))
                declared.Add("constant " + field.Name + " " + field.GetRawConstantValue());
        foreach (Type type in typeof(Native).GetNestedTypes())
            if (type.IsValueType) AddStructure(type, declared);
        declared.Add("struct clamor_error " + Native.ErrorBytes);
        declared.Add("member clamor_error code 0 4");
        declared.Add("member clamor_error sentence 4 " + (Native.ErrorBytes - 4));
        foreach (MethodInfo method in typeof(Native).GetMethods(all)) {
            if (!method.Name.StartsWith("clamor_")) continue;
            string line = "function " + method.Name + " " + Kind(method.ReturnType);
            foreach (ParameterInfo parameter in method.GetParameters())
                line += " " + Kind(parameter.ParameterType);
            declared.Add(line);
        }
        var header = new SortedSet<string>();
        foreach (string line in File.ReadAllLines(table))
            if (!line.Contains("_VERSION_M") && !line.Contains("_VERSION_P")) header.Add(line);
        foreach (string line in header)
            if (!declared.Contains(line)) Console.WriteLine("clamor.h has, and Clamor.cs has not: " + line);
        foreach (string line in declared)
            if (!header.Contains(line)) Console.WriteLine("Clamor.cs has, and clamor.h has not: " + line);
        Require(header.Count > 50 && header.SetEquals(declared), "the declarations differ");
    }

    static Listener Cheap(Context clamor, Level level)
    {
        return clamor.CreateListener(level, new ListenerOptions {
            Output = Output.Receivers, Voices = 20, Pose = new Pose(0, 1.7, 3) });
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
        using (var ears = Cheap(clamor, level)) return Peak(clamor, ears);
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
            Require(Peak(clamor, ears) > 100, "the source is not heard");
            var voices = new Voice[100];
            double timeS;
            int count = ears.GetVoices(voices, out timeS), own = 0;
            for (int i = 0; i < count; ++i)
                if (voices[i].LevelSound < 0 && voices[i].Z < -0.999f && voices[i].Gain1kHz > 100) ++own;
            Require(own == 1 && timeS > 0, "voices");
            group.Change(isMuted: true);
            clamor.Commit();
            Peak(clamor, ears);
            Require(Peak(clamor, ears) < 100, "the group is not mute");
            source.Change(new SourceOptions { Sound = stream, Gain = 1000 });
            source.Move(new Motion { Y = 1.7, Z = 1.5 });
            Require(stream.Write(tone, 0, tone.Length) == tone.Length, "Write()");
            long allocated = Allocated(() => {
                for (int i = 0; i < 100; ++i) stream.Write(tone, 0, 16);
            });
            Require(allocated == 0, "Write() allocates");
            clamor.Commit();
            Require(Peak(clamor, ears) > 100, "the stream is not heard");
            source.Dispose();
            Require(CodeOf(() => source.Move(new Motion())) == -2, "a source that is disposed of");
        }
    }

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

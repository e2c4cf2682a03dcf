// csharp_binding_sounds.cs: the checks of csharp_binding.cs of what a listener hears.
using System;
using System.Collections.Generic;
using System.IO;
using System.Threading;
using Clamor;

static partial class CSharpBinding
{
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
}

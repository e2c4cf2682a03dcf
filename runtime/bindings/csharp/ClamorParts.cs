// ClamorParts.cs: movable parts: doors, lifts and barriers, of a level or of the application's own.
using System;

namespace Clamor
{
    // The name of its node in glTF or "", and the last pose that the part was given, at first that of
    // the level.
    public struct PartInfo
    {
        public string Name;
        public int Triangles;
        public Pose Pose;
        public bool IsEnabled;
    }

    // As clamor_part_options in clamor.h: a box of half extents in metres, or a mesh.
    public sealed class PartOptions
    {
        public double HalfX, HalfY, HalfZ;
        public float[] VerticesM;  // x, y, z each, relative to the pivot
        public int[] Indices;      // of vertices, three for each triangle
        public Pose Pose = new Pose(0, 0, 0);
        public Level Level;          // only listeners in this level hear it; null: all
        public double Transmission;  // share of the power that passes a surface, 0 to 1
        public double[] BandTransmissions;  // instead of it, eight shares, 63 Hz to 8 kHz
        // Eight shares each: of the power that is not reflected, at least the transmission (null: 0.1, or
        // the transmission where that is more), and of the rest that is not reflected as by a mirror.
        public double[] BandAbsorptions, BandScatterings;
        public bool IsDisabled;
    }

    // A part that the application moves as a rigid body. It hides what is behind it and reflects what
    // arrives, per band. All changes take effect with the next Context.Commit().
    public sealed class Part : ContextObject
    {
        private readonly bool isAdded;

        // A part of a level, which ends with the level.
        internal Part(Context context, ulong handle) : base(context, handle) { }

        // Adds a box or a mesh. The arrays are copied.
        public Part(Context context, PartOptions options) : base(context)
        {
            if ((options.VerticesM == null) != (options.Indices == null))
                throw new ArgumentException("a mesh has VerticesM and Indices");
            if (options.VerticesM != null && options.VerticesM.Length % 3 != 0)
                throw new ArgumentException("VerticesM has three numbers for each vertex");
            if (options.Indices != null && options.Indices.Length % 3 != 0)
                throw new ArgumentException("Indices has three numbers for each triangle");
            isAdded = true;
            using (var memory = new NativeMemory())
                Handle = Native.AddPart(context.Handle, new Native.clamor_part_options {
                    is_disabled = options.IsDisabled ? 1u : 0u, level = HandleOf(options.Level),
                    pose = options.Pose,
                    half_extents_m = new Doubles3(options.HalfX, options.HalfY, options.HalfZ),
                    vertices_m = memory.Pin(options.VerticesM), vertices = Thirds(options.VerticesM),
                    indices = memory.Pin(options.Indices), triangles = Thirds(options.Indices),
                    transmission = Doubles8.Of(options.BandTransmissions, options.Transmission, "BandTransmissions"),
                    absorption = Doubles8.Of(options.BandAbsorptions, 0, "BandAbsorptions"),
                    scattering = Doubles8.Of(options.BandScatterings, 0, "BandScatterings") });
        }

        private static uint Thirds(Array numbers) => numbers == null ? 0 : (uint)(numbers.Length / 3);

        public PartInfo Info
        {
            get {
                var info = Native.GetPartInfo(Context.Handle, Handle);
                return new PartInfo { Name = NativeMemory.Read(info.name), Triangles = (int)info.triangles,
                    Pose = info.pose, IsEnabled = info.is_disabled == 0 };
            }
        }

        // Turns and moves the part about its pivot.
        public void Move(Pose pose) => Native.MovePart(Context.Handle, Handle, pose);

        // A part that is not enabled hides nothing.
        public void Enable(bool isEnabled) =>
            Native.EnablePart(Context.Handle, Handle, isEnabled ? 1u : 0u);

        // Dispose() removes a part that the application has added. A part of a level stays.
        internal override int GiveBack() =>
            isAdded ? Native.clamor_remove_part(Context.Handle, Handle) : Native.CLAMOR_OK;
    }
}

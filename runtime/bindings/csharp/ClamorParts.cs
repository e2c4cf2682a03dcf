// ClamorParts.cs: movable parts: doors, lifts and barriers, of a level or of the application's own.
using System;
using System.Runtime.InteropServices;

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
    public sealed class Part : IDisposable
    {
        private readonly Context context;
        private readonly bool isAdded;
        private ulong handle;

        // A part of a level, which ends with the level.
        internal Part(Context context, ulong handle)
        {
            this.context = context;
            this.handle = handle;
        }

        // Adds a box or a mesh. The arrays are copied.
        public Part(Context context, PartOptions options)
        {
            if ((options.VerticesM == null) != (options.Indices == null))
                throw new ArgumentException("a mesh has VerticesM and Indices");
            if (options.VerticesM != null && options.VerticesM.Length % 3 != 0)
                throw new ArgumentException("VerticesM has three numbers for each vertex");
            if (options.Indices != null && options.Indices.Length % 3 != 0)
                throw new ArgumentException("Indices has three numbers for each triangle");
            this.context = context;
            isAdded = true;
            Native.clamor_part_options given = WithoutMesh(options);
            var error = new byte[Native.ErrorBytes];
            GCHandle vertices = GCHandle.Alloc(options.VerticesM, GCHandleType.Pinned);
            GCHandle indices = GCHandle.Alloc(options.Indices, GCHandleType.Pinned);
            int code;
            try {
                if (options.VerticesM != null) {
                    given.vertices_m = vertices.AddrOfPinnedObject();
                    given.vertices = (uint)(options.VerticesM.Length / 3);
                    given.indices = indices.AddrOfPinnedObject();
                    given.triangles = (uint)(options.Indices.Length / 3);
                }
                code = Native.clamor_add_part(context.Handle, ref given, out handle, error);
            } finally {
                vertices.Free();
                indices.Free();
            }
            ClamorException.Check(code, error);
        }

        private static Native.clamor_part_options WithoutMesh(PartOptions options)
        {
            double[] t = Bands(options.BandTransmissions, options.Transmission, "BandTransmissions");
            double[] a = Bands(options.BandAbsorptions, 0, "BandAbsorptions");
            double[] s = Bands(options.BandScatterings, 0, "BandScatterings");
            return new Native.clamor_part_options {
                bytes = Native.clamor_part_options.Size, is_disabled = options.IsDisabled ? 1u : 0u,
                level = options.Level == null ? 0 : options.Level.Handle,
                pose = options.Pose.ToNative(), half_extents_m_0 = options.HalfX,
                half_extents_m_1 = options.HalfY, half_extents_m_2 = options.HalfZ,
                transmission_0 = t[0], transmission_1 = t[1], transmission_2 = t[2], transmission_3 = t[3],
                transmission_4 = t[4], transmission_5 = t[5], transmission_6 = t[6], transmission_7 = t[7],
                absorption_0 = a[0], absorption_1 = a[1], absorption_2 = a[2], absorption_3 = a[3],
                absorption_4 = a[4], absorption_5 = a[5], absorption_6 = a[6], absorption_7 = a[7],
                scattering_0 = s[0], scattering_1 = s[1], scattering_2 = s[2], scattering_3 = s[3],
                scattering_4 = s[4], scattering_5 = s[5], scattering_6 = s[6], scattering_7 = s[7] };
        }

        // Those given, or the same share eight times.
        private static double[] Bands(double[] given, double share, string name)
        {
            if (given != null && given.Length != 8) throw new ArgumentException(name + " has eight numbers");
            if (given != null) return given;
            var bands = new double[8];
            for (int b = 0; b < 8; ++b) bands[b] = share;
            return bands;
        }

        public PartInfo Info
        {
            get {
                var info = new Native.clamor_part_info { bytes = Native.clamor_part_info.Size };
                ClamorException.Check(Native.clamor_get_part_info(context.Handle, handle, ref info));
                return new PartInfo { Name = NativeText.Read(info.name), Triangles = (int)info.triangles,
                    Pose = Pose.FromNative(info.pose), IsEnabled = info.is_disabled == 0 };
            }
        }

        // Turns and moves the part about its pivot.
        public void Move(Pose pose)
        {
            Native.clamor_pose moved = pose.ToNative();
            ClamorException.Check(Native.clamor_move_part(context.Handle, handle, ref moved));
        }

        // A part that is not enabled hides nothing.
        public void Enable(bool isEnabled)
        {
            ClamorException.Check(Native.clamor_enable_part(context.Handle, handle, isEnabled ? 1u : 0u));
        }

        // Removes a part that the application has added. A part of a level stays.
        public void Dispose()
        {
            if (isAdded && handle != 0 && !context.Handle.IsClosed)
                Native.clamor_remove_part(context.Handle, handle);
            handle = 0;
        }
    }
}

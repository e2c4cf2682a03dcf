// ClamorBakeNative.cs: clamor_bake.h for P/Invoke, as ClamorNative.cs is clamor.h. ClamorBaking.cs is
// what applications use.
using System;
using System.Runtime.InteropServices;

namespace Clamor
{
    internal static class BakeNative
    {
#if UNITY_IOS && !UNITY_EDITOR
        private const string Library = "__Internal";
#else
        private const string Library = "clamor_bake";
#endif

        public const int CLAMOR_BAKE_ABI_VERSION = 0;
        public const int CLAMOR_BAKE_BANDS = 8;

        public const int CLAMOR_BAKE_OK = 0;
        public const int CLAMOR_BAKE_ERROR_ARGUMENT = -1;
        public const int CLAMOR_BAKE_ERROR_FILE = -3;
        public const int CLAMOR_BAKE_ERROR_MEMORY = -4;
        public const int CLAMOR_BAKE_ERROR_INTERNAL = -8;
        public const int CLAMOR_BAKE_ERROR_LEVEL = -9;
        public const int CLAMOR_BAKE_ERROR_CANCELLED = -10;
        public const int CLAMOR_BAKE_ERROR_WARNINGS = -11;

        public const int CLAMOR_BAKE_PREPARING = 0;
        public const int CLAMOR_BAKE_TRACING = 1;
        public const int CLAMOR_BAKE_SORTING = 2;
        public const int CLAMOR_BAKE_WRITING = 3;

        public const int CLAMOR_BAKE_NOTE = 0;
        public const int CLAMOR_BAKE_WARNING = 1;

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_level_options
        {
            public const uint Size = 40;
            public uint bytes, hidden_meshes;
            public IntPtr acoustics, material, emitters;
            public ulong emitter_count;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_material
        {
            public const uint Size = 56;
            public uint bytes;
            public IntPtr name, preset, absorption, scattering, phong, transmission;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_sound
        {
            public const uint Size = 48;
            public uint bytes, plays_once;
            public IntPtr name, path, samples;
            public ulong frames;
            public uint rate_hz;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_emitter
        {
            public const uint Size = 96;
            public uint bytes, sound;
            public IntPtr name;
            public double position_m_0, position_m_1, position_m_2;
            public double facing_0, facing_1, facing_2;
            public double gain, directivity;
            public IntPtr directivity_bands;
            public double delay_s;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_air
        {
            public const uint Size = 32;
            public uint bytes;
            public double temperature_c, humidity_percent, pressure_kpa;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_level_info
        {
            public const uint Size = 48;
            public uint bytes, materials, sounds, emitters;
            public ulong triangles;
            public float low_m_0, low_m_1, low_m_2, high_m_0, high_m_1, high_m_2;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_progress
        {
            public const uint Size = 80;
            public uint bytes, phase;
            public double fraction;
            public ulong photons, photons_total, photons_reused, bounces, escaped;
            public double bounces_per_s, error_db, seconds;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_options
        {
            public const uint Size = 128;
            public uint bytes, threads;
            public ulong seed, photons, sources;
            public double goal_error_db, goal_s, simplify_m, roulette_exponent, longest_path_s;
            public ulong memory_bytes;
            public uint no_instances, strict;
            public IntPtr journal, user, progress, message;
            public uint has_early_order, early_order;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_bake_report
        {
            public const uint Size = 120;
            public uint bytes, warnings;
            public ulong sources, photons, photons_reused, file_bytes;
            public uint missed_goal;
            public float error_db;
            public float t30_s_0, t30_s_1, t30_s_2, t30_s_3, t30_s_4, t30_s_5, t30_s_6, t30_s_7;
            public float t30_error_s_0, t30_error_s_1, t30_error_s_2, t30_error_s_3, t30_error_s_4,
                t30_error_s_5, t30_error_s_6, t30_error_s_7;
            public double seconds;
        }

        // A clamor_bake_error is the array of its bytes: an int, then the sentence.
        public const int ErrorBytes = 1024;

        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate int ProgressFunction(IntPtr user, ref clamor_bake_progress progress);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate void MessageFunction(IntPtr user, uint kind, IntPtr sentence);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr clamor_bake_result_text(int result);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern uint clamor_bake_version();
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern uint clamor_bake_abi_version();
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_read_level(byte[] path,
            ref clamor_bake_level_options options, out IntPtr level, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_create_level(byte[] name, out IntPtr level,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern void clamor_bake_destroy_level(IntPtr level);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_add_material(BakeLevelHandle level,
            ref clamor_bake_material values, out uint material, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr clamor_bake_preset_name(uint index);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_add_triangles(BakeLevelHandle level, float[] vertices_m,
            ulong vertex_count, int[] indices, ulong triangle_count, uint material,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_add_sound(BakeLevelHandle level,
            ref clamor_bake_sound values, out uint sound, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_add_emitter(BakeLevelHandle level,
            ref clamor_bake_emitter values, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_set_air(BakeLevelHandle level, ref clamor_bake_air air,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_get_level_info(BakeLevelHandle level,
            ref clamor_bake_level_info info);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_to_file(BakeLevelHandle level,
            ref clamor_bake_options options, byte[] path, ref clamor_bake_report report,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_bake_to_memory(BakeLevelHandle level,
            ref clamor_bake_options options, out IntPtr baked, out ulong byte_count,
            ref clamor_bake_report report, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern void clamor_bake_free(IntPtr baked);
    }

    // The pointer to a level, which is destroyed once it is closed and no call uses it.
    internal sealed class BakeLevelHandle : SafeHandle
    {
        public BakeLevelHandle(IntPtr level) : base(IntPtr.Zero, true)
        {
            SetHandle(level);
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            BakeNative.clamor_bake_destroy_level(handle);
            return true;
        }
    }
}

// ClamorNative.cs: clamor.h for P/Invoke: its constants, structures and functions under their names
// there. Clamor.cs is what applications use.
//
// All structures are blittable, so nothing is marshalled by reflection and ahead-of-time compilers
// (IL2CPP) need no hints. An array member a[n] is n members a_0 to a_(n-1). A test compares all of it
// with the header.
using System;
using System.Runtime.InteropServices;

namespace Clamor
{
    internal static class Native
    {
#if UNITY_IOS && !UNITY_EDITOR
        private const string Library = "__Internal";
#else
        private const string Library = "clamor";
#endif

        public const int CLAMOR_ABI_VERSION = 0;

        public const int CLAMOR_OK = 0;
        public const int CLAMOR_ERROR_ARGUMENT = -1;
        public const int CLAMOR_ERROR_HANDLE = -2;
        public const int CLAMOR_ERROR_FILE = -3;
        public const int CLAMOR_ERROR_MEMORY = -4;
        public const int CLAMOR_ERROR_FULL = -5;
        public const int CLAMOR_ERROR_BUSY = -6;
        public const int CLAMOR_ERROR_STATE = -7;
        public const int CLAMOR_ERROR_INTERNAL = -8;
        public const int CLAMOR_ERROR_NOT_FOUND = -12;

        public const int CLAMOR_OUTPUT_BINAURAL = 0;
        public const int CLAMOR_OUTPUT_LOUDSPEAKERS = 1;
        public const int CLAMOR_OUTPUT_AMBISONICS = 2;
        public const int CLAMOR_OUTPUT_RECEIVERS = 3;
        public const int CLAMOR_OUTPUT_NONE = 4;

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_options
        {
            public const uint Size = 56;
            public uint bytes, caller_updates;
            public double update_period_s;
            public uint max_sources, max_sounds;
            public IntPtr user, log, thread_begins, thread_ends;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_reader
        {
            public const uint Size = 56;
            public uint bytes;
            public IntPtr name;
            public ulong size;
            public IntPtr user, read, memory, release;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_level_info
        {
            public const uint Size = 32;
            public uint bytes, emitters, sounds, portals;
            public ulong sources;
            public uint parts;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_emitter_info
        {
            public const uint Size = 48;
            public uint bytes, sound;
            public double position_m_0, position_m_1, position_m_2;
            public double gain;
            public IntPtr name;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_portal_info
        {
            public const uint Size = 88;
            public uint bytes;
            public double centre_m_0, centre_m_1, centre_m_2;
            public double half_u_m_0, half_u_m_1, half_u_m_2;
            public double half_v_m_0, half_v_m_1, half_v_m_2;
            public IntPtr name;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_emitter_options
        {
            public const uint Size = 32;
            public uint bytes, is_muted, has_gain;
            public ulong group;
            public double gain;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_pose
        {
            public const uint Size = 56;
            public double position_m_0, position_m_1, position_m_2;
            public double orientation_0, orientation_1, orientation_2, orientation_3;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_part_info
        {
            public const uint Size = 88;
            public uint bytes, triangles;
            public ulong level;
            public clamor_pose pose;
            public uint is_disabled;
            public IntPtr name;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_part_options
        {
            public const uint Size = 312;
            public uint bytes, is_disabled;
            public ulong level;
            public clamor_pose pose;
            public double half_extents_m_0, half_extents_m_1, half_extents_m_2;
            public IntPtr vertices_m, indices;
            public uint vertices, triangles;
            public double transmission_0, transmission_1, transmission_2, transmission_3;
            public double transmission_4, transmission_5, transmission_6, transmission_7;
            public double absorption_0, absorption_1, absorption_2, absorption_3;
            public double absorption_4, absorption_5, absorption_6, absorption_7;
            public double scattering_0, scattering_1, scattering_2, scattering_3;
            public double scattering_4, scattering_5, scattering_6, scattering_7;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_listener_options
        {
            public const uint Size = 128;
            public uint bytes, output;
            public IntPtr layout, sofa;
            public uint rate_hz, max_block_frames, voices;
            public ulong memory_bytes;
            public double gain;
            public uint limits, offline;
            public clamor_pose pose;
            public uint reports_voices;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_listener_statistics
        {
            public const uint Size = 72;
            public uint bytes, voices;
            public ulong keyframes, held_blocks;
            public double keyframe_ms;
            public ulong pages, page_bytes, sound_bytes, failures;
            public uint unseen_sources;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_sound_options
        {
            public const uint Size = 12;
            public uint bytes, rate_hz, loops;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_stream
        {
            public const uint Size = 32;
            public uint bytes, rate_hz;
            public IntPtr user, pull, release;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_group_options
        {
            public const uint Size = 32;
            public uint bytes, is_muted, is_paused, has_gain;
            public double gain, max_voices;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_motion
        {
            public const uint Size = 72;
            public double position_m_0, position_m_1, position_m_2;
            public double velocity_mps_0, velocity_mps_1, velocity_mps_2;
            public double axis_0, axis_1, axis_2;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_source_options
        {
            public const uint Size = 264;
            public uint bytes, ends_with_sound;
            public ulong sound, group, level;
            public clamor_motion motion;
            public double gain;
            public double band_gains_0, band_gains_1, band_gains_2, band_gains_3, band_gains_4,
                band_gains_5, band_gains_6, band_gains_7;
            public double directivity_0, directivity_1, directivity_2, directivity_3, directivity_4,
                directivity_5, directivity_6, directivity_7;
            public double played_s;
            public uint has_reverberation;
            public double reverberation;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_voice
        {
            public const uint Size = 72;
            public uint slot, starts;
            public ulong sound;
            public uint level_sound;
            public float direction_0, direction_1, direction_2;
            public double delay_s;
            public float band_gains_0, band_gains_1, band_gains_2, band_gains_3, band_gains_4,
                band_gains_5, band_gains_6, band_gains_7;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct clamor_voices
        {
            public const uint Size = 32;
            public uint bytes, capacity;
            public IntPtr voices;
            public uint count;
            public double time_s;
        }

        // A clamor_error is the array of its bytes: an int, then the sentence.
        public const int ErrorBytes = 512;

        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate int ReadFunction(IntPtr user, ulong offset, ulong count, IntPtr into);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate void ReleaseFunction(IntPtr user);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate void LogFunction(IntPtr user, IntPtr sentence);
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate uint PullFunction(IntPtr user, IntPtr samples, uint frames);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern IntPtr clamor_result_text(int result);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern uint clamor_version();
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern uint clamor_abi_version();
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_create(ref clamor_options options, out IntPtr context,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern void clamor_destroy(IntPtr context);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_update(ContextHandle context, double loading_s, out uint made);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_open_level(ContextHandle context, byte[] path, out ulong level,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_open_level_with(ContextHandle context, ref clamor_reader reader,
            out ulong level, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_close_level(ContextHandle context, ulong level);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_level_info(ContextHandle context, ulong level,
            ref clamor_level_info info);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_emitter_info(ContextHandle context, ulong level,
            uint emitter, ref clamor_emitter_info info);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_find_emitter(ContextHandle context, ulong level, byte[] name,
            out uint emitter);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_change_emitter(ContextHandle context, ulong level,
            uint emitter, ref clamor_emitter_options options);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_portal_info(ContextHandle context, ulong level,
            uint portal, ref clamor_portal_info info);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_find_portal(ContextHandle context, ulong level, byte[] name,
            out uint portal);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_set_portal(ContextHandle context, ulong level, uint portal,
            double openness);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_create_listener(ContextHandle context, ulong level,
            ref clamor_listener_options options, out ulong listener, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_destroy_listener(ContextHandle context, ulong listener);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_enter_level(ContextHandle context, ulong listener, ulong level,
            [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_move_listener(ContextHandle context, ulong listener,
            ref clamor_pose pose);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_next_keyframe(ContextHandle context, ulong listener,
            out uint wanted, out double time_s);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_channels(ContextHandle context, ulong listener,
            out uint channels);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_listener_statistics(ContextHandle context, ulong listener,
            ref clamor_listener_statistics statistics);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_add_sound(ContextHandle context, float[] samples, ulong frames,
            ref clamor_sound_options options, out ulong sound, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_read_sound(ContextHandle context, byte[] path,
            ref clamor_sound_options options, out ulong sound, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_read_level_sound(ContextHandle context, ulong level, uint index,
            out ulong sound, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_add_stream(ContextHandle context, ref clamor_stream stream,
            out ulong sound, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_write_stream(IntPtr context, ulong sound, ref float samples,
            uint frames, out uint taken);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_remove_sound(ContextHandle context, ulong sound);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_add_group(ContextHandle context,
            ref clamor_group_options options, out ulong group);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_change_group(ContextHandle context, ulong group,
            ref clamor_group_options options);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_remove_group(ContextHandle context, ulong group);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_add_source(ContextHandle context,
            ref clamor_source_options options, out ulong source);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_change_source(ContextHandle context, ulong source,
            ref clamor_source_options options);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_move_source(ContextHandle context, ulong source,
            ref clamor_motion motion);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_remove_source(ContextHandle context, ulong source);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_level_part(ContextHandle context, ulong level, uint number,
            out ulong part);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_find_part(ContextHandle context, ulong level, byte[] name,
            out ulong part);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_part_info(ContextHandle context, ulong part,
            ref clamor_part_info info);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_add_part(ContextHandle context, ref clamor_part_options options,
            out ulong part, [In, Out] byte[] error);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_move_part(ContextHandle context, ulong part,
            ref clamor_pose pose);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_enable_part(ContextHandle context, ulong part, uint enabled);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_remove_part(ContextHandle context, ulong part);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_commit(ContextHandle context, double time_s);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_get_voices(ContextHandle context, ulong listener,
            ref clamor_voices voices);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_measure_responses(ContextHandle context, ulong level,
            uint emitter, double[] positions_m, uint places, [In, Out] float[] samples, ulong frames,
            out ulong whole_frames, [In, Out] byte[] error);
        // A reference to the first sample pins the array while the call lasts, and copies nothing.
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_render(IntPtr context, ulong listener, ref float interleaved,
            uint frames);
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern int clamor_render_planar(IntPtr context, ulong listener,
            [In] IntPtr[] planes, uint frames);
    }

    // The pointer to a context, which is destroyed once it is closed and no call uses it.
    internal sealed class ContextHandle : SafeHandle
    {
        private GCHandle user;

        // `user` is freed with the context, if it is allocated.
        public ContextHandle(IntPtr context, GCHandle user) : base(IntPtr.Zero, true)
        {
            SetHandle(context);
            this.user = user;
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            Native.clamor_destroy(handle);
            if (user.IsAllocated) user.Free();
            return true;
        }
    }

#if !UNITY_5_3_OR_NEWER
    // Ahead-of-time compilers know this attribute by its name. Unity has its own, in AOT.
    [AttributeUsage(AttributeTargets.Method)]
    internal sealed class MonoPInvokeCallbackAttribute : Attribute
    {
        public MonoPInvokeCallbackAttribute(Type type) { }
    }
#endif
}

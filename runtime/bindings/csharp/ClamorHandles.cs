// ClamorHandles.cs: owners of what the library has made, and memory that its calls read.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Clamor
{
    // What a context holds. Dispose() gives it back; further calls do nothing.
    public abstract class ContextObject : IDisposable
    {
        internal readonly Context Context;
        internal ulong Handle;

        internal ContextObject(Context context, ulong handle = 0)
        {
            Context = context;
            Handle = handle;
        }

        internal abstract int GiveBack();

        public virtual void Dispose()
        {
            if (Handle != 0 && !Context.Handle.IsClosed) GiveBack();
            Handle = 0;
        }

        internal static ulong HandleOf(ContextObject owner) => owner == null ? 0 : owner.Handle;
    }

    // A pointer to what the library owns, which is given back once it is closed and no call uses it.
    internal sealed class NativeHandle : SafeHandle
    {
        private readonly Action<IntPtr> giveBack;

        public NativeHandle(IntPtr pointer, Action<IntPtr> giveBack) : base(IntPtr.Zero, true)
        {
            this.giveBack = giveBack;
            SetHandle(pointer);
        }

        public override bool IsInvalid => handle == IntPtr.Zero;

        // Audio thread: holds it until DangerousRelease(); false if it is closed. Never throws.
        public bool TryHold()
        {
            bool held = false;
            try {
                if (!IsClosed) DangerousAddRef(ref held);
            } catch (ObjectDisposedException) {  // closed in between
            }
            return held;
        }

        protected override bool ReleaseHandle()
        {
            giveBack(handle);
            return true;
        }
    }

    // Strings and arrays that a call of the library reads; all are given back at the end.
    internal sealed class NativeMemory : IDisposable
    {
        private readonly List<GCHandle> pinned = new List<GCHandle>();

        // The address of an array, which stays where it is; null stays null.
        public IntPtr Pin(Array array)
        {
            if (array == null) return IntPtr.Zero;
            GCHandle handle = GCHandle.Alloc(array, GCHandleType.Pinned);
            pinned.Add(handle);
            return handle.AddrOfPinnedObject();
        }

        public IntPtr Text(string text) => Pin(text == null ? null : Utf8(text));

        public IntPtr Texts(string[] values) =>
            Pin(values == null ? null : Array.ConvertAll(values, Text));

        public IntPtr Bands(float[] values)
        {
            if (values != null && values.Length != BakeNative.CLAMOR_BAKE_BANDS)
                throw new ArgumentException("there must be a value for each of eight bands");
            return Pin(values);
        }

        public void Dispose()
        {
            foreach (GCHandle handle in pinned) handle.Free();
        }

        public static byte[] Utf8(string text) => Encoding.UTF8.GetBytes(text + "\0");

        // The text at a pointer that the library gave.
        public static string Read(IntPtr text)
        {
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) ++length;
            var bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
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

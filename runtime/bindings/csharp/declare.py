"""Writes ClamorNative.cs for P/Invoke: declare.py clamor.h clamor_bake.h >ClamorNative.cs

A class for each header holds its constants, structures and functions under their names there, and,
for each function that returns a code, one that throws, as OpenLevel() for clamor_open_level(). That
takes strings, and structures whose `bytes` it sets, and returns what the function writes; several
results are `out` parameters.

All structures are blittable, so nothing is marshalled by reflection and ahead-of-time compilers
(IL2CPP) need no hints. An array is a structure of its elements.
"""
import sys
from pathlib import Path
from string import Template

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python/clamor"))
from _header import Header  # noqa: E402

NUMBERS = {"void": "void", "float": "float", "double": "double", "int32_t": "int",
           "uint32_t": "uint", "uint64_t": "ulong"}
ARRAYS = {"const char*": "byte[]", "const float*": "float[]", "float*": "[In, Out] float[]",
          "const double*": "double[]", "const uint32_t*": "int[]", "float*const*": "[In] IntPtr[]"}
# Structures of the binding's users, whose members are laid out as those of the header.
PUBLIC = {"clamor_pose": "Pose", "clamor_motion": "Motion"}
# These take a context that the caller holds open, and a reference to the first sample, which pins
# the array while the call lasts. They allocate nothing.
AUDIO = ("clamor_render", "clamor_render_planar", "clamor_write_stream")

FILE = Template("""\
// ClamorNative.cs: clamor.h and clamor_bake.h for P/Invoke. Written by declare.py; do not edit.
using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Clamor
{
$parts
}""")
ARRAY = Template("""
    [StructLayout(LayoutKind.Sequential)]
    internal struct $name
    {
        public $kind $members;

        // The elements of an array, which is named in an error, or `otherwise` for null.
        public static $name Of($kind[] v, $kind otherwise, string name)
        {
            if (v == null) return new $name($repeated);
            if (v.Length != $count) throw new ArgumentException(name + " has $count numbers");
            return new $name($elements);
        }

        public $name($parameters)
        {
            $assignments
        }

        public $kind[] ToArray()
        {
            return new[] { $members };
        }
    }""")
CLASS = Template("""
    internal static class $name
    {
#if UNITY_IOS && !UNITY_EDITOR
        private const string Library = "__Internal";
#else
        private const string Library = "$library";
#endif
        // The structure for errors is the array of its bytes: an int, then the sentence.
        public const int ErrorBytes = $error_bytes;

        // `error` may be null.
        public static void Check(int code, byte[] error)
        {
            if (code == 0) return;
            throw new ClamorException(code, error == null
                ? NativeMemory.Read(${library}_result_text(code))
                : Encoding.UTF8.GetString(error, 4, Array.IndexOf(error, (byte)0, 4) - 4));
        }
$declarations
    }""")
DELEGATE = Template("""
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        public delegate $result ${name}Function($parameters);""")
STRUCTURE = Template("""
        [StructLayout(LayoutKind.Sequential)]
        public struct $name
        {
            public static readonly uint Size = (uint)Marshal.SizeOf(typeof($name));
            $members
        }""")
FUNCTION = Template("""
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern $result $name($parameters);""")
THROWING = Template("""
        public static $result $name($parameters)
        {
            ${before}Check($call, $error);$after
        }""")


def pascal(name):
    """ReadLevel for read_level."""
    return "".join(word.capitalize() for word in name.split("_"))


def array_name(member):
    return f"{member.type.capitalize()}s{member.count}"


def array(member):
    """The structure for the arrays of a type and length."""
    kind, each = member.type, range(member.count)
    return ARRAY.substitute(
        name=array_name(member), kind=kind, count=member.count,
        members=", ".join(f"_{i}" for i in each), parameters=", ".join(f"{kind} v{i}" for i in each),
        assignments=" ".join(f"_{i} = v{i};" for i in each),
        repeated=", ".join("otherwise" for _ in each), elements=", ".join(f"v[{i}]" for i in each))


class Declarations:
    """The members of the class for a header."""

    def __init__(self, header):
        self.header = header

    def structure_of(self, text):
        """The structure that a type is or points to, or ""."""
        name = text.rstrip("*").replace("const ", "")
        return PUBLIC.get(name, name if name in self.header.structures else "")

    def member(self, member):
        if member.count:
            return array_name(member)
        if member.parameters is not None or member.type.endswith("*"):
            return "IntPtr"
        return NUMBERS.get(member.type) or self.structure_of(member.type)

    def parameter(self, parameter, is_raw):
        kind, structure = parameter.type, self.structure_of(parameter.type)
        if parameter.name == "error":
            return "[In, Out] byte[]"
        if structure:
            return f"ref {structure}"
        if parameter.is_result:
            return "out " + NUMBERS.get(kind[:-1], "IntPtr")
        if is_raw and kind in ("const float*", "float*"):
            return "ref float"
        pointer = "IntPtr" if is_raw or kind == "void*" else "NativeHandle"
        return NUMBERS.get(kind) or ARRAYS.get(kind) or pointer

    def delegate(self, member):
        kinds = [self.parameter(p, True) if self.structure_of(p.type) else
                 NUMBERS.get(p.type, "IntPtr") for p in member.parameters]
        words = [f"{kind} {p.name}" for kind, p in zip(kinds, member.parameters)]
        return DELEGATE.substitute(result=NUMBERS[member.type], name=pascal(member.name),
                                   parameters=", ".join(words))

    def throwing(self, name, parameters):
        """The function that throws where one of the header returns a code."""
        results = [p for p in parameters if p.is_result and p.name != "error"]
        is_one, taken, before, passed, error = len(results) == 1, [], [], [], "null"
        for p in parameters:
            kind, structure = self.parameter(p, False), self.structure_of(p.type)
            how = "ref " if structure else "out " if p.is_result else ""
            passed.append(how + p.name)
            if p.name == "error":
                error = passed[-1] = "error"
                before.append("var error = new byte[ErrorBytes];")
            elif p in results:
                if structure:
                    var = "var " if is_one else ""
                    before.append(f"{var}{p.name} = new {structure} {{ bytes = {structure}.Size }};")
                elif is_one:
                    passed[-1] = f"{kind} {p.name}"
                if not is_one:
                    taken.append(f"out {structure or kind[4:]} {p.name}")
            elif kind == "byte[]":
                taken.append(f"string {p.name}")
                passed[-1] = f"NativeMemory.Utf8({p.name})"
            else:
                taken.append(f"{kind if structure == p.type[:-1] else structure or kind} {p.name}")
                if self.header.structures.get(structure, [p])[0].name == "bytes":
                    before.append(f"{p.name}.bytes = {structure}.Size;")
        return THROWING.substitute(
            result=self.parameter(results[0], False)[4:] if is_one else "void",
            name=pascal(name.replace("clamor_bake_", "").replace("clamor_", "")),
            parameters=", ".join(taken).replace("[In, Out] ", ""), error=error,
            before="".join(line + "\n            " for line in before),
            call=f"{name}({', '.join(passed)})",
            after=f"\n            return {results[0].name};" if is_one else "")

    def all(self):
        for name, value in self.header.constants.items():
            kind = "double" if isinstance(value, float) else "int"
            yield f"\n        public const {kind} {name} = {value};"
        yield from sorted({self.delegate(m) for members in self.header.structures.values()
                           for m in members if m.parameters is not None})
        for name, members in self.header.structures.items():
            if not name.endswith("_error") and name not in PUBLIC:
                lines = [f"public {self.member(m)} {m.name};" for m in members]
                yield STRUCTURE.substitute(name=name, members="\n            ".join(lines))
        for name, function in self.header.functions.items():
            is_raw = name in AUDIO or function.result != "int32_t"
            words = [f"{self.parameter(p, is_raw)} {p.name}" for p in function.parameters]
            yield FUNCTION.substitute(result=NUMBERS.get(function.result, "IntPtr"), name=name,
                                      parameters=", ".join(words))
            if not is_raw:
                yield self.throwing(name, function.parameters)


def main(paths):
    headers = {Path(path).stem: Header(Path(path).read_text("utf-8")) for path in paths}
    parts = [array(member) for member in sorted({
        member._replace(name="") for header in headers.values()
        for name, members in header.structures.items() for member in members
        if member.count and member.type != "char" and name not in PUBLIC})]
    for library, header in headers.items():
        parts.append(CLASS.substitute(
            name="BakeNative" if library.endswith("_bake") else "Native", library=library,
            error_bytes=4 + header.structures[f"{library}_error"][1].count,
            declarations="".join(Declarations(header).all())))
    print(FILE.substitute(parts="\n".join(parts)))


if __name__ == "__main__":
    main(sys.argv[1:])

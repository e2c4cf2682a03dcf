#!/usr/bin/env python3
"""Writes declarations.js: structures and functions of clamor.h as native.js takes them, for WebAssembly.

usage: declare.py ../../clamor.h > declarations.js
"""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python" / "clamor"))
from _header import Header, Variable  # noqa: E402

SIZES = {"char": 1, "int32_t": 4, "uint32_t": 4, "float": 4, "int64_t": 8, "uint64_t": 8, "double": 8}


class Layouts:
    """Sizes and offsets, where pointers have 32 bits."""

    def __init__(self, header: Header):
        self._header = header
        self.structures = {}
        for name in header.structures:
            self._lay_out(name)

    def _lay_out(self, name: str) -> dict:
        if name in self.structures:
            return self.structures[name]
        members, end, most = {}, 0, 1
        for member in self._header.structures[name]:
            kind, size, alignment = self._kind(member)
            at = -(-end // alignment) * alignment
            members[member.name] = [at, kind, member.count]
            end, most = at + size * max(member.count, 1), max(most, alignment)
        self.structures[name] = {"size": -(-end // most) * most, "members": members}
        return self.structures[name]

    def _kind(self, variable: Variable) -> tuple:
        if variable.parameters is not None or variable.type.endswith("*"):
            kind = "string" if variable.type == "const char*" and variable.parameters is None else "pointer"
            return kind, 4, 4
        if variable.type in SIZES:
            return variable.type, SIZES[variable.type], SIZES[variable.type]
        layout = self._lay_out(variable.type)
        return variable.type, layout["size"], 8


def parameter(header: Header, variable: Variable) -> str:
    """How native.js passes it: by what type, with "=" before it if the function writes it."""
    target = variable.type.removeprefix("const ").removesuffix("*")
    if variable.type == "const char*":
        return "string"
    if variable.is_result or (variable.type == f"{target}*" and target in header.structures):
        return "=" + ("pointer" if target.endswith("*") else target)
    if target in header.structures and variable.type.endswith("*"):
        return target
    return "pointer" if variable.type.endswith("*") else variable.type


def main() -> None:
    header = Header(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))
    functions = {name: [function.result, *(parameter(header, each) for each in function.parameters)]
                 for name, function in header.functions.items()}
    print("// Written from clamor.h by declare.py.")
    for name, value in (("constants", header.constants), ("structures", Layouts(header).structures),
                        ("functions", functions)):
        print(f"export const {name} = {json.dumps(value, separators=(',', ':'))};")


if __name__ == "__main__":
    main()

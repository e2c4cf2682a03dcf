"""Reads a header of Clamor: its constants, structures and functions.

The package declares them for ctypes when it is imported. The C of clamor.h and clamor_bake.h is
understood, not all of C; tests compare what was read with what a compiler says.
"""
from __future__ import annotations

import re
from typing import Dict, List, NamedTuple, Optional, Tuple, Union


class Variable(NamedTuple):
    """A parameter of a function, or a member of a structure.

    `type` is written without spaces around stars, "const char*", and with the numbers that typedefs
    stand for. `count` is the length of an array, or 0. `parameters` are those of a pointer to a
    function, which returns `type`; None: it is no such pointer.
    """

    name: str
    type: str
    count: int = 0
    parameters: Optional[List["Variable"]] = None

    @property
    def is_result(self) -> bool:
        """Whether a function writes one value to this parameter. Arrays are const or of floats."""
        return bool(re.fullmatch(r"(double|void\*|u?int\d+_t|clamor_\w+\*|"
                                 r"clamor_(\w+_)?(info|statistics|report|error))\*", self.type))


class Function(NamedTuple):
    """A function: the type that it returns, and its parameters."""

    result: str
    parameters: List[Variable]


class Header:
    """What a header declares, by name and in its order."""

    def __init__(self, text: str):
        text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        self._numbers = {name: number for number, name in
                         re.findall(r"typedef (u?int\d+_t) (\w+);", text)}
        self.constants: Dict[str, Union[int, float]] = {
            name: float(value) if "." in value else int(value)
            for name, value in re.findall(r"\b(CLAMOR_\w+) (?:= |\()?(-?\d[\d.]*)", text)}
        self.structures: Dict[str, List[Variable]] = {
            name: [member for line in body.split(";") for member in self._members(line)]
            for name, body in re.findall(r"typedef struct (\w+) \{([^}]*)\}", text)}
        self.functions: Dict[str, Function] = {
            name: Function(self._type(result), self._parameters(parameters))
            for result, name, parameters in
            re.findall(r"\nCLAMOR_(?:BAKE_)?API ([\w\s*]+?)(\w+)\(([^)]*)\);", text)}

    def _type(self, text: str) -> str:
        words = re.sub(r"\s*\*\s*", "*", " ".join(text.split()))
        return re.sub(r"\w+", lambda word: self._numbers.get(word[0], word[0]), words)

    def _variables(self, declaration: str) -> List[Variable]:
        """Those of "double centre_m[3], gain"."""
        kind, names = re.fullmatch(r"([\w\s*]*?[\s*])(\w+(?:\[\w+\])?(?:,\s*\w+(?:\[\w+\])?)*)",
                                   declaration.strip()).groups()
        return [Variable(name, self._type(kind), int(self.constants.get(count, count or 0)))
                for name, count in re.findall(r"(\w+)(?:\[(\w+)\])?", names)]

    def _parameters(self, text: str) -> List[Variable]:
        return [variable for declaration in text.split(",") if declaration.strip() != "void"
                for variable in self._variables(declaration)]

    def _members(self, declaration: str) -> List[Variable]:
        function = re.fullmatch(r"\s*([\w\s*]+)\(\*(\w+)\)\(([^)]*)\)\s*", declaration)
        if function is None:
            return self._variables(declaration) if declaration.strip() else []
        result, name, parameters = function.groups()
        return [Variable(name, self._type(result), parameters=self._parameters(parameters))]

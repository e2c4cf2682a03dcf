"""Declares what the headers hold, finds and loads the libraries, and calls their functions."""
from __future__ import annotations

import ctypes
import functools
import os
from ctypes import CFUNCTYPE, POINTER, byref
from pathlib import Path
from typing import Any, Dict, List

from ._header import Header, Variable

_NUMBERS = {"void": None, "char": ctypes.c_char, "float": ctypes.c_float, "double": ctypes.c_double,
            "int32_t": ctypes.c_int32, "uint32_t": ctypes.c_uint32, "uint64_t": ctypes.c_uint64}


class ClamorWarning(UserWarning):
    """Something that no call can return, such as a listener who is outside the level."""


class ClamorError(RuntimeError):
    """A call failed. `code` is one of the header's, for example ERROR_FILE."""

    def __init__(self, code: int, sentence: str):
        super().__init__(sentence)
        self.code = code


class Structure(ctypes.Structure):
    """A structure whose first member, if it is `bytes`, is its size."""

    def __init__(self, **members: Any):
        super().__init__(**members)
        if self._fields_[0][0] == "bytes":
            self.bytes = ctypes.sizeof(self)


class Interface:
    """A header and its library, which is loaded at the first call.

    Attributes are the header's constants and structures under their names there, and the types of
    callbacks, as clamor_options_log for that member of clamor_options.
    """

    def __init__(self, path: str):
        here = Path(__file__).resolve()
        installed = here.with_name(Path(path).name)  # else this is the source tree
        file = installed if installed.is_file() else here.parents[4] / path
        header = Header(file.read_text("utf-8"))
        self._name = installed.stem
        self._declared: Dict[str, Any] = dict(header.constants)
        for name, members in header.structures.items():
            fields = [(member.name, self._member(name, member)) for member in members]
            self._declared[name] = type(name, (Structure,), {"_fields_": fields})
        self.signatures = {name: (self._type(function.result),
                                  [self._type(parameter.type) for parameter in function.parameters])
                           for name, function in header.functions.items()}
        # For each parameter of a function the type that the function writes to it, or None.
        self._results = {name: [self._type(parameter.type[:-1]) if parameter.is_result else None
                                for parameter in function.parameters]
                         for name, function in header.functions.items()}

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__.get("_declared", ()):
            return self._declared[name]
        raise AttributeError(name)

    def _type(self, text: str) -> Any:
        structure = self._declared.get(text.rstrip("*").replace("const ", ""))
        if not text.endswith("*"):
            return structure or _NUMBERS[text]
        if text == "const char*":
            return ctypes.c_char_p
        return POINTER(structure) if structure else ctypes.c_void_p

    def _member(self, structure: str, member: Variable) -> Any:
        kind = self._type(member.type)
        if member.parameters is None:
            return kind * member.count if member.count else kind
        callback = CFUNCTYPE(kind, *(self._type(parameter.type) for parameter in member.parameters))
        self._declared[f"{structure}_{member.name}"] = callback
        return callback

    def _places(self, file: str) -> List[str]:
        """The places to look for a library, in order; the last is the system's search."""
        chosen = os.environ.get(f"{self._name.upper()}_LIBRARY")
        if chosen:
            return [chosen]
        places = []
        if os.environ.get("CLAMOR_LIBRARY"):  # the other libraries lie beside the first
            places.append(str(Path(os.environ["CLAMOR_LIBRARY"]).with_name(file)))
        here = Path(__file__).resolve()
        places.append(str(here.with_name(file)))
        places.append(str(here.parents[3] / file))  # PREFIX/lib, above python3/dist-packages/clamor
        return [place for place in places if Path(place).is_file()] + [file]

    @functools.cached_property
    def library(self) -> ctypes.CDLL:
        """Raises OSError if the library is not found, of another ABI version, or too old."""
        version = self._declared[f"{self._name.upper()}_ABI_VERSION"]
        file, loaded, failures = f"lib{self._name}.so", None, []
        for place in [*self._places(file), *self._places(f"{file}.{version}")]:
            try:
                loaded = ctypes.CDLL(place)
                break
            except OSError as error:
                failures.append(str(error))
        if loaded is None:
            raise OSError(f"{file} cannot be loaded ({'; '.join(dict.fromkeys(failures))}). Install "
                          f"Clamor, or set {self._name.upper()}_LIBRARY to the library's path.")
        found = loaded[f"{self._name}_abi_version"]()
        if found != version:
            raise OSError(f"{loaded._name} has ABI version {found}, and this package needs {version}. "
                          f"Install the package and the library of one version.")
        for name, (result, arguments) in self.signatures.items():
            declared = getattr(loaded, name, None)
            if declared is None:
                raise OSError(f"{loaded._name} has no {name}: it is older than this package. "
                              f"Install the package and the library of one version.")
            declared.restype, declared.argtypes = result, arguments
        return loaded

    def call(self, name: str, *arguments: Any) -> Any:
        """Calls a function that returns a code, with its parameters but those that it writes to.

        Returns what it wrote to those: None, a value or a tuple. Raises ClamorError if it failed.
        """
        given, function = iter(arguments), getattr(self.library, name)
        written = [kind and kind() for kind in self._results[name]]
        code = function(*(next(given) if result is None else byref(result) for result in written))
        results = [result for result in written if result is not None]
        error = results.pop() if results and hasattr(results[-1], "sentence") else None
        if code != 0:
            text_of = getattr(self.library, f"{self._name}_result_text")
            sentence = (error and error.sentence) or text_of(code)
            raise ClamorError(code, sentence.decode("utf-8", "replace"))
        values = [result if isinstance(result, Structure) else result.value for result in results]
        return values[0] if len(values) == 1 else tuple(values) or None


runtime, bake = Interface("runtime/clamor.h"), Interface("bake/clamor_bake.h")

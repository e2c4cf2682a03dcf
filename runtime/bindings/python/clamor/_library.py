"""Finds and loads the shared libraries, and turns their error codes into exceptions."""
from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

# Return type and argument types of each function of a header.
Signatures = Dict[str, Tuple[Any, List[Any]]]


class ClamorWarning(UserWarning):
    """Something that no call can return, such as a listener who is outside the level."""


class ClamorError(RuntimeError):
    """A call failed. `code` is one of the header's, for example ERROR_FILE."""

    def __init__(self, code: int, sentence: str):
        super().__init__(sentence)
        self.code = code


def _places(variable: str, name: str) -> List[str]:
    """The places to look for a library, in order; the last is the system's search."""
    if os.environ.get(variable):
        return [os.environ[variable]]
    places = []
    if os.environ.get("CLAMOR_LIBRARY"):  # the other libraries lie beside the first
        places.append(str(Path(os.environ["CLAMOR_LIBRARY"]).with_name(name)))
    here = Path(__file__).resolve()
    places.append(str(here.with_name(name)))
    places.append(str(here.parents[3] / name))  # PREFIX/lib, above python3/dist-packages/clamor
    return [place for place in places if Path(place).is_file()] + [name]


def load(variable: str, names: Tuple[str, str], abi: Tuple[str, int],
         signatures: Signatures) -> ctypes.CDLL:
    """Loads a library and declares its functions.

    `names` are the file's name without and with the ABI version; `abi` is the function that tells
    the ABI version, and the one that this package is written for. Raises OSError if the library is
    not found or of another ABI version.
    """
    library = None
    failures = []
    for place in [place for name in names for place in _places(variable, name)]:
        try:
            library = ctypes.CDLL(place)
            break
        except OSError as error:
            failures.append(str(error))
    if library is None:
        raise OSError(f"{names[0]} cannot be loaded ({'; '.join(dict.fromkeys(failures))}). "
                      f"Install Clamor, or set {variable} to the library's path.")
    function, version = abi
    found = getattr(library, function)()
    if found != version:
        raise OSError(f"{library._name} has ABI version {found}, and this package needs {version}. "
                      f"Install the package and the library of one version.")
    for name, (result, arguments) in signatures.items():
        declared = getattr(library, name, None)
        if declared is None:
            raise OSError(f"{library._name} has no {name}: it is older than this package. "
                          f"Install the package and the library of one version.")
        declared.restype, declared.argtypes = result, arguments
    return library


class Structure(ctypes.Structure):
    """A structure whose first member, if it is `bytes`, is its size."""

    def __init__(self, **members: Any):
        super().__init__(**members)
        if self._fields_[0][0] == "bytes":
            self.bytes = ctypes.sizeof(self)


def checker(text_of: Callable[[], Any]) -> Callable[..., None]:
    """Returns a function that raises ClamorError for a code that is not 0.

    `text_of` returns the library's function that describes a code.
    """

    def check(code: int, error: Any = None) -> None:
        if code == 0:
            return
        sentence = error.sentence if error is not None else b""
        sentence = sentence or text_of()(code)
        raise ClamorError(code, sentence.decode("utf-8", "replace"))

    return check

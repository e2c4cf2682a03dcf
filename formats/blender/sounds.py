"""The bytes and the format of Blender's sounds."""

from pathlib import Path

import bpy

_MAGIC = {b"fLaC": "audio/flac", b"OggS": "audio/ogg", b"RIFF": "audio/wav", b"RF64": "audio/wav"}


def path_of(sound: bpy.types.Sound) -> Path:
    """Where the file of a sound is, even if it is packed into the .blend file."""
    return Path(bpy.path.abspath(sound.filepath, library=sound.library))


def bytes_of(sound: bpy.types.Sound) -> bytes:
    """The sound file, packed or from disk. Raises OSError if it cannot be read."""
    if sound.packed_file is not None:
        return bytes(sound.packed_file.data)
    return path_of(sound).read_bytes()


def is_readable(sound: bpy.types.Sound) -> bool:
    return sound.packed_file is not None or path_of(sound).is_file()


def mime_type_of(data: bytes) -> str:
    """The MIME type by the first bytes; names of packed sounds may have lost their suffix."""
    return _MAGIC.get(data[:4], "audio/mpeg")

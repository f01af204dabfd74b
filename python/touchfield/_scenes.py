"""Scenes as Python writes them: a path, YAML text, or a dict with meshes, arrays and targets in it."""

import atexit
import hashlib
import json
import os
import shutil
import tempfile

from ._arrays import Array
from ._bodies import Mesh
from ._plain import plain
from ._targets import Target

_folders = {}  # by process: a fork has its own


def _folder():
    process = os.getpid()
    if process not in _folders:
        _folders[process] = tempfile.mkdtemp(prefix="touchfield-")
        atexit.register(lambda: os.getpid() == process and shutil.rmtree(_folders[process], ignore_errors=True))
    return _folders[process]


def _file_of(mesh):
    """A file of the mesh that lasts as long as this process, to the last bit."""
    content = hashlib.sha256(mesh.vertices.tobytes() + mesh.triangles.tobytes()).hexdigest()
    path = os.path.join(_folder(), content[:32] + ".ply")
    if not os.path.exists(path):
        mesh.save(path, unit=1.0)
    return path


def _file_of_levels(levels):
    """A file of a mask's levels, likewise."""
    content = "".join(f"{level!r}\n" for level in levels)
    path = os.path.join(_folder(), hashlib.sha256(content.encode()).hexdigest()[:32] + ".txt")
    if not os.path.exists(path):
        with open(path, "w") as file:
            file.write(content)
    return path


def _mesh_keys(mesh):
    keys = {"file": _file_of(mesh), "unit": "m"}
    if mesh.landmarks:
        keys["landmarks"] = {name: point.tolist() for name, point in mesh.landmarks.items()}
    return keys


def written(value, key=""):
    """A part of a scene in what JSON knows."""
    if isinstance(value, dict):
        return {name: written(part, name) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [written(part, key) for part in value]
    if isinstance(value, Mesh):
        return _mesh_keys(value) if key == "mesh" else {"mesh": _mesh_keys(value)}
    if isinstance(value, Array):
        return value._scene_keys()
    if isinstance(value, Target):
        return {name: _file_of_levels(part) if name == "mask_file" else part for name, part in value._scene_keys().items()}
    return value


def source(scene):
    """What the library reads: the path, or a text and its name. That of a dict has none, nor lines that its user knows."""
    if isinstance(scene, dict):
        return json.dumps(written({"name": "scene", **scene}), default=plain), ""
    if isinstance(scene, str) and "\n" in scene:
        return scene, "scene"
    return scene

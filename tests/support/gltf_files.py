"""glTF files made by code, array by array: a box, and what moves its vertices."""

import json
from base64 import b64encode

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES

from parameterize.surface.surface import load_surface

BOX = CUBE * [1.0, 2.0, 4.0]  # volume 8
TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126, "f8": 5130}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
INSTANCES = "EXT_mesh_gpu_instancing"


class Gltf:
    """A glTF with one mesh, of one primitive: a box of volume 8. Its document may be changed before it is written."""

    def __init__(self, vertices=BOX, faces=TRIANGLES, position="f4", **document):
        self.binary = b""
        self.document = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        attributes = {"POSITION": self.array(vertices, position)}
        self.primitive = {"attributes": attributes, "indices": self.array(np.ravel(faces), "u2")}
        self.mesh = {"primitives": [self.primitive]}
        self.node = {"mesh": 0}
        self.document |= {"scenes": [{"nodes": [0]}], "nodes": [self.node], "meshes": [self.mesh], **document}

    def view(self, values, kind):
        """The number of a new buffer view with these values."""
        data = np.ascontiguousarray(values, f"<{kind}").tobytes()
        self.binary += b"\0" * (-len(self.binary) % 8)
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.document["bufferViews"]) - 1

    def accessor(self, **given):
        """The number of a new accessor."""
        self.document["accessors"].append(given)
        return len(self.document["accessors"]) - 1

    def array(self, values, kind="f4", **more):
        """The number of a new accessor of rows of values."""
        values = np.asarray(values)
        width = values.shape[1] if values.ndim > 1 else 1
        view = self.view(values, kind)
        return self.accessor(bufferView=view, componentType=TYPES[kind], count=len(values), type=KINDS[width], **more)

    def sparse(self, count, places, values, *, indices="u1", kind="f4", **more):
        """The number of a new accessor, zero but for the values (n, 3) at these places."""
        entries = {
            "count": len(places),
            "indices": {"bufferView": self.view(places, indices), "componentType": TYPES[indices]},
            "values": {"bufferView": self.view(values, kind)},
        }
        return self.accessor(componentType=TYPES[kind], count=count, type="VEC3", sparse=entries, **more)

    def morph(self, *deltas, mesh=None, node=None):
        """Morph targets of these displacements (n, 3), and the weights of the mesh and of its node."""
        self.primitive["targets"] = [{"POSITION": self.array(delta)} for delta in deltas]
        self.mesh |= {} if mesh is None else {"weights": mesh}
        self.node |= {} if node is None else {"weights": node}
        return self

    def skin(self, *joints, places=None, weights=None, inverse=None, kinds=("u1", "f4"), **more):
        """A skin of these nodes: all vertices follow the first one, or by places and weights (n, 4)."""
        first = np.tile([1, 0, 0, 0], (len(BOX), 1))
        places, weights = 0 * first if places is None else places, first if weights is None else weights
        self.primitive["attributes"] |= {
            "JOINTS_0": self.array(places, kinds[0]),
            "WEIGHTS_0": self.array(weights, kinds[1], **more),
        }
        self.node["skin"] = 0
        skin = {"joints": list(range(1, 1 + len(joints)))}
        if inverse is not None:  # (j, 4, 4)
            skin["inverseBindMatrices"] = self.array(np.transpose(inverse, (0, 2, 1)).reshape(-1, 16))
        self.document["nodes"] += joints
        self.document["skins"] = [skin]
        self.document["scenes"][0]["nodes"] += skin["joints"]
        return self

    def instances(self, **arrays):
        """Instances at the node, from the numbers of accessors."""
        self.node["extensions"] = {INSTANCES: {"attributes": arrays}}
        return self

    def pieces(self):
        """The description and the binary chunk, as a .glb has them."""
        document = {**self.document, "buffers": [{"byteLength": len(self.binary)}, *self.document.get("buffers", [])]}
        return json.dumps(document).encode(), self.binary

    def text(self):
        """A .gltf with its buffer inside."""
        document = json.loads(self.pieces()[0])
        document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + b64encode(self.binary).decode()
        return json.dumps(document).encode()


def read(folder, gltf, **options):
    """The surface of a glTF that is written into a folder."""
    path = folder / "box.gltf"
    path.write_bytes(gltf.text())
    return load_surface(path, **options)


def check(surface, volume, lowest, highest, *notices):
    """Volume, bounding box and notices of a surface are these; faces that are turned inside out have a notice, too."""
    assert surface.volume == pytest.approx(volume, rel=1e-6)
    assert np.allclose(surface.bbox, [lowest, highest], rtol=1e-6, atol=1e-6)
    assert surface.notices == notices


def moved():
    """Boxes whose vertices are moved in every way, for a fuzzer to spoil: morph target and skin, instances."""
    gltf = Gltf().morph(BOX * [0, 0, 1], mesh=[1.0])
    halves = np.tile([0.5, 0.5, 0, 0], (8, 1))
    yield gltf.skin({"scale": [2, 2, 2]}, {}, places=[[0, 1, 0, 0]] * 8, weights=halves, inverse=[np.eye(4)] * 2)
    gltf = Gltf()
    gltf.primitive["attributes"]["POSITION"] = gltf.sparse(8, range(1, 8), BOX[1:])
    turned = gltf.array([[0, 0, 127, 0]], "i1", normalized=True)
    yield gltf.instances(TRANSLATION=gltf.array([[9.0, 0, 0]]), ROTATION=turned, SCALE=gltf.array([[2.0, 1, -1]]))

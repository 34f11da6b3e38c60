"""Meshes of the comparison, written once as binary STL into a folder."""

import math
import shutil
import struct
import subprocess
import sys
from pathlib import Path

ICOSPHERES = {"sphere-82k": 6, "sphere-1.3M": 8, "sphere-5M": 9}
SPHERE_RADIUS_MM = 25.0
BUNDLED = {"cube": "cube.stl", "gear": "gear.stl"}
# Made by others: taken from a folder that the user names.
REAL = {"voron": "voron_cw2_main_body.stl", "benchy": "benchy.stl"}

NAMES = ["cube", "gear", "voron", "benchy", "sphere-82k", "gyroid-1M", "sphere-1.3M", "sphere-5M"]


def write_stl(path, corners):
    """`corners` has the shape (triangles, 3, 3), mm; the lowest point is put on the bed."""
    import numpy as np

    corners = corners.astype(np.float32)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    corners = corners - np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]], np.float32)
    facets = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]))
    facets["corners"] = corners
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets["normal"] = normal / np.where(length > 0, length, 1)
    with open(path, "wb") as out:
        out.write(bytes(80) + struct.pack("<I", len(facets)))
        out.write(facets.tobytes())


def icosphere(level):
    """An icosahedron whose sides are halved `level` times, corners put back on the sphere."""
    import numpy as np

    t = (1 + math.sqrt(5)) / 2
    points = np.array(
        [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t],
         [0, -1, -t], [0, 1, -t], [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]], float)
    points /= np.linalg.norm(points[0])
    faces = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
         [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
         [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]])
    corners = points[faces]
    for _ in range(level):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        # The middle of a side is computed from its ends in one order, so that neighbours agree.
        middle = [m / np.linalg.norm(m, axis=1, keepdims=True) for m in (a + b, b + c, c + a)]
        ab, bc, ca = middle
        corners = np.concatenate(
            [np.stack(f, axis=1) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return corners * SPHERE_RADIUS_MM


def gyroid(count=122, size=40.0, cell=10.0, thickness=0.55):
    """A shell about the gyroid surface in a cube, by marching cubes: many islands, thin walls."""
    import numpy as np
    from skimage.measure import marching_cubes

    grid = np.linspace(-1, size + 1, count)
    x, y, z = np.meshgrid(grid, grid, grid, indexing="ij")
    k = 2 * math.pi / cell
    wave = np.sin(k * x) * np.cos(k * y) + np.sin(k * y) * np.cos(k * z) + np.sin(k * z) * np.cos(k * x)
    box = np.minimum.reduce([x, size - x, y, size - y, z, size - z]) * 2.0
    step = grid[1] - grid[0]
    points, faces, _, _ = marching_cubes(
        np.minimum(thickness - abs(wave), box), 0.0, spacing=(step,) * 3, gradient_direction="ascent")
    return points[faces]


def provide(name, folder, repository, real):
    """The path of a mesh, made now if it is not there; None where it has to come from others."""
    path = Path(folder) / f"{name}.stl"
    if path.exists():
        return path
    if name in BUNDLED:
        shutil.copy(Path(repository) / "models" / BUNDLED[name], path)
    elif name in REAL:
        source = Path(real) / REAL[name] if real else None
        if source is None or not source.exists():
            return None
        shutil.copy(source, path)
    else:
        # In a process of its own: what this one holds would count as memory of those it starts.
        subprocess.run([sys.executable, __file__, name, path], check=True)
    return path


def triangles(path):
    with open(path, "rb") as file:
        return struct.unpack("<I", file.read(84)[80:])[0]


if __name__ == "__main__":
    shape, target = sys.argv[1:]
    write_stl(target, icosphere(ICOSPHERES[shape]) if shape in ICOSPHERES else gyroid())

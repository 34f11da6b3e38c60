#!/usr/bin/env python3
"""Slices the same meshes with rhumb and with the slicers that Debian has, in turn, and prints
medians of CPU and wall time, peak memory and size of the program, and the ratios.

    python3 benches/peers/run.py [--real FOLDER] [--meshes NAME,…] [--runs N] [--markdown FILE]

Needs Debian, as root for the first run (it installs prusa-slicer, slic3r and cura-engine), and
numpy and scikit-image from PyPI, which it puts into a folder of its own.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
sys.path.insert(0, str(HERE))

# A slicer that takes longer than this for a mesh is measured once, s.
LONG = 20.0
# And is stopped after this, s.
LONGEST = 900.0

RHUMB = ["--no-verify", "--layers", "planar"]
RHUMB_SETTINGS = {
    "layer_height_mm": 0.2, "first_layer_height_mm": 0.2, "perimeters": 2, "fill_density": "15%",
    "fill_pattern": "rectilinear", "top_solid_layers": 4, "bottom_solid_layers": 4, "skirts": 0, "snap": "off",
}


class Run:
    def __init__(self, cpu, wall, memory, size):
        self.cpu, self.wall, self.memory, self.size = cpu, wall, memory, size


def measured(command, out, env=None):
    """One run of a command that writes `out`; None when it fails."""
    Path(out).unlink(missing_ok=True)
    start = time.monotonic()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen([str(word) for word in command], stdout=quiet, stderr=quiet, env=env)
    while True:
        done, status, usage = os.wait4(process.pid, os.WNOHANG)
        if done:
            break
        if time.monotonic() - start > LONGEST:
            process.kill()
        time.sleep(0.002)
    wall = time.monotonic() - start
    # What the kernel told us is all that there is to be told.
    process.returncode = status
    size = Path(out).stat().st_size if Path(out).exists() else 0
    # rhumb ends with 1 where something needs a look; the program is there.
    if size == 0 or os.waitstatus_to_exitcode(status) not in (0, 1):
        return None
    return Run(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024, size)


def rhumb(binary, model, out, *more):
    settings = [word for item in RHUMB_SETTINGS.items() for word in ("--set", "{}={}".format(*item))]
    return [binary, "slice", model, "-q", "-o", out, *RHUMB, *settings, *more]


def floor(model, program, out):
    """Reading the mesh and writing as many bytes as the program has, and nothing else."""
    return ["sh", "-c", f"cat '{model}' > /dev/null; cat '{program}' > '{out}'"]


def median(runs, what):
    return statistics.median(getattr(run, what) for run in runs)


def turns(commands, out, runs):
    """Runs all commands one after the other, again and again; the results by name."""
    results, once = {name: [] for name in commands}, set()
    for _ in range(runs):
        for name, command in commands.items():
            if name in once:
                continue
            run = measured(command, out)
            if run is None:
                once.add(name)
                continue
            results[name].append(run)
            if run.cpu > LONG:
                once.add(name)
    return results


def row(mesh, count, name, runs, ours):
    if not runs:
        return [mesh, count, name, "fails", "", "", "", ""]
    cpu = median(runs, "cpu")
    ratio = f"{cpu / ours:.1f}" if ours else ""
    return [mesh, count, name, f"{cpu:.3f}", f"{median(runs, 'wall'):.3f}", f"{median(runs, 'memory'):.0f}",
            f"{median(runs, 'size') / 1e6:.2f}", ratio]


HEAD = ["mesh", "triangles", "slicer", "CPU s", "wall s", "peak MB", "program MB", "CPU by rhumb's"]


def table(rows):
    lines = ["| " + " | ".join(HEAD) + " |", "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: |"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def venv(cache):
    """Starts again with a Python that has numpy and scikit-image."""
    python = cache / "venv/bin/python"
    if Path(sys.executable) == python or os.environ.get("RHUMB_PEERS_VENV"):
        return
    if not python.exists():
        subprocess.run(["python3", "-m", "venv", cache / "venv"], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "numpy", "scikit-image"], check=True)
    os.environ["RHUMB_PEERS_VENV"] = "1"
    os.execv(python, [str(python), str(Path(__file__).resolve()), *sys.argv[1:]])


def built():
    subprocess.run(["cargo", "build", "-q", "--release", "-p", "rhumb"], cwd=REPOSITORY, check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")) / "release/rhumb"


def main():
    import meshes
    import peers

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--real", help="folder with benchy.stl and voron_cw2_main_body.stl")
    parser.add_argument("--meshes", default=",".join(meshes.NAMES), metavar="NAME,…")
    parser.add_argument("--slicers", default=",".join(peers.PEERS), metavar="NAME,…")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--rhumb", type=Path, help="a program that is built already")
    parser.add_argument("--cache", type=Path, default=REPOSITORY / "target/peers")
    parser.add_argument("--markdown", type=Path, help="where the table goes, too")
    options = parser.parse_args()
    cache = options.cache.resolve()
    cache.mkdir(parents=True, exist_ok=True)
    venv(cache)
    peers.install(cache)
    binary = options.rhumb or built()
    out, rows = cache / "out.gcode", []
    for mesh in options.meshes.split(","):
        model = meshes.provide(mesh, cache, REPOSITORY, options.real)
        if model is None:
            print(f"{mesh}: not here (see --real)", file=sys.stderr)
            continue
        commands = {
            "rhumb": rhumb(binary, model, out),
            "rhumb, 1 thread": rhumb(binary, model, out, "--threads", "1"),
            # Straight lines as they are, like those of the others.
            "rhumb, cartesian": rhumb(binary, model, out, "--dialect", "cartesian"),
        }
        for name in filter(None, options.slicers.split(",")):
            commands[name] = peers.PEERS[name](cache, model, out)
        kept = cache / "kept.gcode"
        measured(rhumb(binary, model, kept), kept)
        commands["floor"] = floor(model, kept, out)
        results = turns(commands, out, options.runs)
        ours = median(results["rhumb"], "cpu") if results["rhumb"] else None
        for name, runs in results.items():
            rows.append(row(mesh, meshes.triangles(model), name, runs, ours))
            print(*rows[-1], sep="\t", flush=True)
    if options.markdown:
        options.markdown.write_text(table(rows) + "\n")


main()

"""The other slicers: how they are installed and what they are told.

All get the same job: layers of 0.2 mm, lines of 0.45 mm from a nozzle of 0.4, two walls, 15 %
rectilinear infill, four solid layers below and above, no skirt, no support, no slowing down for
cooling, retraction of 1 mm before travels over 1.5 mm.
"""

import json
import math
import subprocess
from pathlib import Path

PACKAGES = ["prusa-slicer", "slic3r", "cura-engine"]


def install(cache):
    """Installs what Debian has; the definitions of Cura are only unpacked into `cache`."""
    missing = [p for p in PACKAGES if subprocess.run(["dpkg", "-s", p], capture_output=True).returncode]
    if missing:
        subprocess.run(["apt-get", "update", "-q"], check=True)
        subprocess.run(["apt-get", "install", "-y", "-q", *missing], check=True)
    if not definitions(cache).exists():
        subprocess.run(["apt-get", "download", "-q", "cura"], cwd=cache, check=True)
        package = next(Path(cache).glob("cura_*.deb"))
        subprocess.run(["dpkg-deb", "-x", package, Path(cache) / "cura"], check=True)


def definitions(cache):
    return Path(cache) / "cura/usr/share/cura/resources/definitions/fdmprinter.def.json"


SLIC3R = {
    "layer_height": "0.2", "first_layer_height": "0.2", "nozzle_diameter": "0.4", "filament_diameter": "1.75",
    "extrusion_width": "0.45", "first_layer_extrusion_width": "0.45", "perimeter_extrusion_width": "0.45",
    "external_perimeter_extrusion_width": "0.45", "infill_extrusion_width": "0.45",
    "solid_infill_extrusion_width": "0.45", "top_infill_extrusion_width": "0.45",
    "perimeters": "2", "fill_density": "15%", "fill_pattern": "rectilinear",
    "top_solid_layers": "4", "bottom_solid_layers": "4", "skirts": "0", "brim_width": "0",
    "support_material": "0", "cooling": "0", "retract_length": "1", "retract_before_travel": "1.5",
    "seam_position": "nearest", "temperature": "210", "first_layer_temperature": "210",
    "bed_temperature": "60", "first_layer_bed_temperature": "60",
}
PRUSA = SLIC3R | {
    "bed_shape": "-150x-150,150x-150,150x150,-150x150", "thin_walls": "0", "gap_fill_enabled": "1",
    "perimeter_generator": "classic", "top_solid_min_thickness": "0", "bottom_solid_min_thickness": "0",
    "gcode_flavor": "marlin2", "max_print_height": "250", "resolution": "0",
}


def ini(path, settings):
    Path(path).write_text("".join(f"{key} = {value}\n" for key, value in settings.items()))
    return path


def prusa_slicer(cache, model, out):
    config = ini(Path(cache) / "prusa.ini", PRUSA)
    return ["prusa-slicer", "--export-gcode", "--load", config, "--center", "0,0", "-o", out, model]


def slic3r(cache, model, out):
    config = ini(Path(cache) / "slic3r.ini", SLIC3R)
    return ["slic3r", "--load", config, "--print-center", "100,100", "-o", out, model]


CURA = {
    "layer_height": 0.2, "layer_height_0": 0.2, "line_width": 0.45, "wall_line_count": 2,
    "top_layers": 4, "bottom_layers": 4, "infill_sparse_density": 15, "infill_pattern": "lines",
    "adhesion_type": "none", "support_enable": False, "machine_nozzle_size": 0.4,
    "material_diameter": 1.75, "retraction_amount": 1.0, "retraction_min_travel": 1.5,
    "cool_min_layer_time": 0, "fill_outline_gaps": True, "fill_perimeter_gaps": "everywhere",
    "meshfix_maximum_deviation": 0.0125, "machine_width": 300, "machine_depth": 300, "machine_height": 250,
    "machine_center_is_zero": True, "center_object": True, "z_seam_type": "shortest",
}


class Resolved(dict):
    """Settings of Cura: what is wanted, else what their formulas give. CuraEngine itself takes only
    their defaults, which do not follow the layer height or the line width."""

    FUNCTIONS = {
        "math": math, "int": int, "round": round, "max": max, "min": min, "abs": abs, "any": any, "all": all,
        "sum": sum, "len": len, "map": map, "str": str, "float": float, "True": True, "False": False,
    }

    def __init__(self, nodes, wanted):
        super().__init__(wanted)
        self.nodes = nodes
        self.busy = set()

    def __missing__(self, key):
        if key in self.FUNCTIONS:
            return self.FUNCTIONS[key]
        helpers = {
            "resolveOrValue": self.__getitem__, "defaultExtruderPosition": lambda: "0",
            "extruderValue": lambda _, name: self[name], "extruderValues": lambda name: [self[name]],
            "extruderValueFromContainer": lambda _, name, __: self[name],
            "valueFromContainer": lambda name, _: self[name],
            "anyExtruderWithMaterial": lambda _: "0", "anyExtruderNrWithOrDefault": lambda _: "0",
        }
        if key in helpers:
            return helpers[key]
        node = self.nodes[key]
        formula, value = node.get("value"), node.get("default_value")
        if isinstance(formula, str) and key not in self.busy:
            self.busy.add(key)
            try:
                value = eval(formula, {"__builtins__": {}}, self)
            except (KeyError, TypeError, ValueError, NameError, AttributeError, SyntaxError):
                pass
            self.busy.discard(key)
        elif formula is not None and not isinstance(formula, str):
            value = formula
        self[key] = value
        return value


def leaves(settings):
    for key, node in settings.items():
        if node.get("type") != "category":
            yield key, node
        yield from leaves(node.get("children", {}))


def cura(cache, model, out):
    base = definitions(cache)
    nodes = dict(leaves(json.loads(base.read_text())["settings"]))
    settings = Resolved(nodes, CURA)
    command = ["CuraEngine", "slice", "-j", base, "-o", out]
    for key in nodes:
        value = settings[key]
        if value is None or callable(value):
            continue
        text = {True: "true", False: "false"}.get(value, value) if isinstance(value, bool) else value
        command += ["-s", f"{key}={json.dumps(text) if isinstance(text, (list, dict)) else text}"]
    return command + ["-e0", "-s", "extruder_nr=0", "-l", model]


PEERS = {"PrusaSlicer": prusa_slicer, "Slic3r": slic3r, "CuraEngine": cura}

"""Open CAD files to measure imports on. Run: python -m tests.benchmarks.cad_files --help.

Writes STL files in millimetres and ``sources.csv`` (file, source, licence) into a folder, from packages:

- ManiSkill, which mskgrasp needs: robots' parts that carry an open licence of their own.
- robosuite: parts of grippers and robots. ``pip install --no-deps --target DIR robosuite``, then give
  ``--packages DIR``.
- bd_warehouse (the extra [cad]): gears, threads, plates of machines, couplings, flanges.
- OpenSCAD with its examples and the library MCAD: ``apt-get install openscad openscad-mcad``.
- Shapes drawn here that are hard to represent by convex hulls: springs, heat sinks, grilles, thin shells.

What is not installed is named, and left out.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from mskgrasp.runtime.progress import note, progress
from tests.benchmarks.cad_shapes import DRAWN, mesh_of

MANISKILL = {
    "so100": ("Apache-2.0", (
        "Moving_Jaw", "Fixed_Jaw", "Fixed_Jaw_Motor", "Upper_Arm", "Lower_Arm_Motor", "Wrist_Pitch_Roll",
        "Wrist_Pitch_Roll_Motor", "Rotation_Pitch_Motor",
    )),
    "koch": ("Apache-2.0", (
        "gripper", "centered_base_link", "link_3_part", "link_2_rotation_connector",
    )),
    "g1_humanoid": ("BSD-3-Clause", (
        "left_four_link", "left_ankle_pitch_link", "right_shoulder_yaw_link", "left_three_link",
        "left_one_link", "left_zero_link", "left_elbow_pitch_link", "left_palm_link", "pelvis_contour_link",
    )),
}  # fmt: skip
"""Robots with a licence file of their own, and those of their meshes that are one closed body."""

ROBOSUITE = (
    "grippers/meshes/robotiq_140_gripper/robotiq_arg2f_140_outer_knuckle_vis.stl",
    "grippers/meshes/robotiq_140_gripper/robotiq_arg2f_140_outer_finger_vis.stl",
    "grippers/meshes/robotiq_140_gripper/robotiq_arg2f_140_inner_knuckle_vis.stl",
    "grippers/meshes/robotiq_85_gripper/robotiq_gripper_coupling_vis.stl",
    "grippers/meshes/robotiq_85_gripper/robotiq_arg2f_85_inner_knuckle_vis.stl",
    "grippers/meshes/robotiq_85_gripper/robotiq_arg2f_85_inner_finger_vis.stl",
    "grippers/meshes/robotiq_85_gripper/robotiq_arg2f_85_outer_knuckle_vis.stl",
    "grippers/meshes/robotiq_s_gripper/link_0_vis.stl",
    "grippers/meshes/robotiq_s_gripper/palm.stl",
    "grippers/meshes/jaco_three_finger_gripper/finger_distal.stl",
    "grippers/meshes/jaco_three_finger_gripper/finger_proximal.stl",
    "grippers/meshes/jaco_three_finger_gripper/ring_small.stl",
    "grippers/meshes/inspire_hands/rh_Link12.STL",
    "grippers/meshes/inspire_hands/rh_Link14.STL",
    "grippers/meshes/inspire_hands/rh_Link18.STL",
    "robots/xarm7/meshes/link7.stl",
    "robots/xarm7/meshes/right_outer_knuckle.stl",
)
"""Meshes below ``robosuite/models/assets``."""

SCAD = {
    "servo_ds420": "use <MCAD/servos.scad>\nalignds420([0,0,0],[0,0,0]);",
    "servo_s3003": "use <MCAD/servos.scad>\nfutabas3003([0,0,0],[0,0,0]);",
    "stepper_nema17": "include <MCAD/stepper.scad>\nmotor(Nema17);",
    "stepper_nema14": "include <MCAD/stepper.scad>\nmotor(Nema14, NemaShort);",
    "involute_gear": (
        "use <MCAD/involute_gears.scad>\ngear(number_of_teeth=30, circular_pitch=200, circles=6);"
    ),
    "bevel_gear": (
        "use <MCAD/involute_gears.scad>\nbevel_gear(number_of_teeth=20, outside_circular_pitch=400);"
    ),
    "twisted_gear": (
        "use <MCAD/involute_gears.scad>\ngear(number_of_teeth=16, circular_pitch=300, gear_thickness=12, "
        "rim_thickness=14, hub_thickness=18, twist=20);"
    ),
    "lego_brick": "use <MCAD/lego_compatibility.scad>\nblock(4,2,1,reinforcement=true);",
    "lego_beam": "use <MCAD/lego_compatibility.scad>\nblock(6,1,1,axle_hole=true);",
    "grid_beam": "include <MCAD/gridbeam.scad>\nscale(0.8) zBeam(3);",
    "auger": "use <MCAD/screw.scad>\nauger(20, 50, 15, 4);",
    "motor_plate": (
        "use <MCAD/motors.scad>\nlinear_extrude(4) difference() { square(50, center=true); "
        "stepper_motor_mount(17, mochup=false); }"
    ),
}
"""OpenSCAD bodies that use MCAD (LGPL-2.1)."""

EXAMPLES = {
    "example001": 0.5, "example002": 0.5, "example003": 0.5, "example004": 0.5, "example005": 0.2,
    "example006": 0.6, "example007": 0.5, "example009": 0.6, "example016": 0.5, "example019": 0.3,
}  # fmt: skip
"""OpenSCAD's examples (CC0-1.0) in the folder ``Old``, and a scale that gives them a part's size."""

EXAMPLES_FOLDER = Path("/usr/share/openscad/examples/Old")


@dataclass(frozen=True, kw_only=True)
class CadFile:
    """One file to export.

    Attributes:
        name: Name of the file without its suffix.
        source: Package, with its file or class.
        licence: SPDX identifier.
        mesh: Makes the mesh, millimetres.
    """

    name: str
    source: str
    licence: str
    mesh: Callable[[], trimesh.Trimesh]


def main() -> None:
    """Export the files."""
    text = __doc__ or ""
    parser = argparse.ArgumentParser(
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        prog="tests.benchmarks.cad_files",
    )
    parser.add_argument("folder", type=Path, help="folder to write to")
    parser.add_argument("--packages", type=Path, help="folder of further packages (pip install --target)")
    options = parser.parse_args()
    print(f"{export(options.folder, options.packages)} files in {options.folder}, with sources.csv")


def export(folder: Path, packages: Path | None = None) -> int:
    """Write the files; return their number.

    Args:
        folder: Made where it is missing.
        packages: Folder of packages that are not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for one in progress(list(cad_files(packages)), unit="file", title="export"):
        try:
            mesh = one.mesh()
        except Exception as error:  # a package of another version: the other files are of use without it
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            note(f"left out {one.name} ({one.source}): {reason}")
            continue
        mesh.export(folder / f"{one.name}.stl")
        rows.append((f"{one.name}.stl", one.source, one.licence))
    with open(folder / "sources.csv", "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("file", "source", "licence"))
        writer.writerows(rows)
    return len(rows)


def cad_files(packages: Path | None = None) -> Iterator[CadFile]:
    """The files of all packages that are installed; a line on stderr for each that is not."""
    yield from _from_maniskill(packages)
    yield from _from_robosuite(packages)
    yield from _from_bd_warehouse()
    yield from _from_openscad()
    for name, make in DRAWN.items():
        yield CadFile(
            name=name, source="drawn by this script", licence="Apache-2.0", mesh=partial(mesh_of, make)
        )


def _package(name: str, packages: Path | None, remedy: str) -> Path | None:
    """The folder of a package, which is not imported; None, and a line on stderr, where it is missing."""
    if packages is not None and (packages / name).is_dir():
        return packages / name
    spec = importlib.util.find_spec(name)
    if spec is not None and spec.submodule_search_locations:
        return Path(next(iter(spec.submodule_search_locations)))
    note(f"left out {name}, which is not installed: {remedy}")
    return None


def _from_maniskill(packages: Path | None) -> Iterator[CadFile]:
    root = _package("mani_skill", packages, "pip install mani-skill")
    for robot, (licence, names) in MANISKILL.items() if root else ():
        for path in sorted((root / "assets" / "robots" / robot).rglob("meshes/*")):
            if path.stem in names and path.suffix.lower() == ".stl":
                yield CadFile(
                    name=f"{robot}_{path.stem.lower()}",
                    source=f"mani_skill, {robot}/{path.name}",
                    licence=licence,
                    mesh=partial(_read, path),
                )


def _from_robosuite(packages: Path | None) -> Iterator[CadFile]:
    root = _package("robosuite", packages, "pip install --no-deps --target DIR robosuite, and --packages DIR")
    for name in ROBOSUITE if root else ():
        path = root / "models" / "assets" / name
        yield CadFile(
            name=f"robosuite_{path.parts[-3 if path.parent.name == 'meshes' else -2]}_{path.stem.lower()}",
            source=f"robosuite, {name}",
            licence="MIT",
            mesh=partial(_read, path),
        )


def _read(path: Path) -> trimesh.Trimesh:
    """A mesh in metres or millimetres, as millimetres."""
    mesh = trimesh.load_mesh(path)
    if float(np.max(mesh.extents)) < 2:
        mesh.apply_scale(1000)
    return mesh


def _from_bd_warehouse() -> Iterator[CadFile]:
    if _package("bd_warehouse", None, "EXTRAS=dev,cad .ci/setup") is None:
        return
    from bd_warehouse import fastener, flange, gear, open_builds, sprocket, thread

    shapes: dict[str, Callable[[], object]] = {
        "spur_gear": lambda: gear.SpurGear(module=2, tooth_count=24, pressure_angle=20, thickness=8),
        "helical_gear": lambda: gear.HelicalGear(
            module=1.5, tooth_count=20, pressure_angle=20, helix_angle=20, thickness=15
        ),
        "rack": lambda: gear.RackGear(module=2, tooth_count=12, pressure_angle=20, thickness=10),
        "worm": lambda: gear.Worm(module=2, starts=1, diametral_quotient=10, length=30),
        "worm_wheel": lambda: gear.WormWheel(
            module=2, tooth_count=24, thickness=12, starts=1, diametral_quotient=10
        ),
        "sprocket": lambda: sprocket.Sprocket(num_teeth=18, bore_diameter=10),
        "iso_thread": lambda: thread.IsoThread(
            major_diameter=24, pitch=3, length=30, end_finishes=("fade", "fade")
        ),
        "threaded_screw": lambda: fastener.HexHeadScrew("M12-1.75", 30, "iso4014", simple=False),
        "threaded_nut": lambda: fastener.HexNut("M20-2.5", "iso4032", simple=False),
        "heat_set_nut": lambda: fastener.HeatSetNut("M5-0.8-Standard", "McMaster-Carr", simple=False),
        "flange": lambda: flange.SlipOnFlange("1", 150),
        "weld_neck_flange": lambda: flange.WeldNeckFlange("1", 150),
        "gantry_plate": open_builds.CBeamGantryPlate,
        "riser_plate": open_builds.CBeamRiserPlate,
        "end_mount": open_builds.CBeamEndMount,
        "nut_block": open_builds.AcmeAntiBacklashNutBlock8mm,
        "eccentric_spacer": lambda: open_builds.EccentricSpacer("6mm"),
        "coupler": lambda: open_builds.FlexibleCoupler("8mm"),
        "rail": lambda: open_builds.CBeamLinearRail(length=60),
    }
    for name, make in shapes.items():
        yield CadFile(
            name=f"bd_{name}",
            source=f"bd_warehouse, {name}",
            licence="Apache-2.0",
            mesh=partial(_tessellated, make),
        )


def _tessellated(make: Callable[[], object]) -> trimesh.Trimesh:
    from build123d import export_stl

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.stl"
        export_stl(make(), str(path), tolerance=0.02, angular_tolerance=0.1)  # pyright: ignore[reportArgumentType]
        return trimesh.load_mesh(path)


def _from_openscad() -> Iterator[CadFile]:
    if shutil.which("openscad") is None or not EXAMPLES_FOLDER.is_dir():
        note("left out OpenSCAD, which is not installed: apt-get install openscad openscad-mcad")
        return
    for name, code in SCAD.items():
        yield CadFile(
            name=f"scad_{name}", source="openscad-mcad", licence="LGPL-2.1", mesh=partial(_rendered, code)
        )
    for name, scale in EXAMPLES.items():
        yield CadFile(
            name=f"scad_{name}",
            source=f"openscad, examples/Old/{name}.scad",
            licence="CC0-1.0",
            mesh=partial(_example, EXAMPLES_FOLDER / f"{name}.scad", scale),
        )


def _rendered(code: str) -> trimesh.Trimesh:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.scad"
        path.write_text(code, encoding="utf-8")
        return _example(path, 1.0)


def _example(path: Path, scale: float) -> trimesh.Trimesh:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "part.stl"
        done = subprocess.run(
            ["openscad", "-o", str(out), str(path)], capture_output=True, text=True, timeout=300, check=False
        )
        if not out.is_file() or out.stat().st_size == 0:
            raise RuntimeError((done.stderr.strip().splitlines() or ["no mesh"])[-1])
        mesh = trimesh.load_mesh(out)
    mesh.apply_scale(scale)
    return mesh


if __name__ == "__main__":
    main()

"""Certified grasps of parts, made by processes of this machine, stored stream by stream."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadPart
from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import TABLE_CLEARANCE, lowest_grasp_z
from mskgrasp.core.settings import REGION, TABLE_Z, Overhead
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.alike_poses import alike_poses
from mskgrasp.planning.certified import (
    CertifiedGrasp,
    CertifiedGrasps,
    certified_folder,
    grasp_from_json,
    read_certified,
)
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.planning.run_inputs import model_digests
from mskgrasp.runtime.progress import note, progress
from mskgrasp.runtime.worker_pool import Work, process_count, results, whole
from mskgrasp.simulation.certify import (
    CERTIFY_VERSION,
    CertifyConfig,
    Member,
    Stream,
    run_stream,
)
from mskgrasp.simulation.hull_count import hull_excess
from mskgrasp.simulation.resting import resting_of
from mskgrasp.simulation.select_certified import SELECT_VERSION, select_certified
from mskgrasp.simulation.versions import versions

LEAST_STREAM = 24
"""Least number of simulations of a stream."""
_VERSIONS = dict(certify_version=CERTIFY_VERSION, select_version=SELECT_VERSION)
_MEASURED_BY = (*_VERSIONS, "pose_errors", "noise", "physics", "least_lifted", "most_error")
"""Conditions that decide which grasps are certified and what is stored of them."""


@dataclass(frozen=True, kw_only=True)
class _Settings:
    config: CertifyConfig
    models: Path


@dataclass(frozen=True, kw_only=True)
class _Made:
    stream: Stream
    grasps: tuple[CertifiedGrasp, ...]


def certify(
    parts: Sequence[str], config: CertifyConfig, models: Path, workers: int, *, hidden: bool = False
) -> dict[str, CertifiedGrasps]:
    """Certify grasps of parts and write them beside the parts in the cache.

    Streams that an earlier, stopped run with the same settings finished are not made again; the result does
    not depend on the workers.

    Args:
        parts: Names or folders.
        config: Settings.
        models: Folder of the networks that choose candidates.
        workers: Processes.
        hidden: Shows no progress.

    Returns:
        Certified grasps by the part's name.

    Raises:
        BadPart: A part cannot be used.
        WorkerFailed: A stream failed for a reason that trying again does not remove.
    """
    conditions = _conditions(config, models)
    # What is simulated does not depend on what is selected of it.
    digest = hashlib.sha256(json.dumps(conditions, sort_keys=True).encode()).hexdigest()[:16]
    conditions |= _VERSIONS
    plans = {name: _plan(find_part(name), config) for name in parts}
    missing = [
        stream
        for plan in plans.values()
        for stream in plan.streams
        if _read_stream(plan.part, stream, digest) is None
    ]
    bar = progress(
        total=sum(one.simulations for one in missing), unit="simulation", title="certify", hidden=hidden
    )
    made = results(
        Work(_certifier, _Settings(config=config, models=models), name=_stream_name, rest=whole),
        missing,
        workers,
    )
    with closing(made), bar:
        for one in made:
            if isinstance(one, _Made):
                _write_stream(find_part(one.stream.part), one, digest)
            else:
                bar.update()
    found = {}
    for plan in plans.values():
        grasps = _merged(plan, config, conditions, digest)
        folder = certified_folder(plan.part)
        grasps.write(folder)
        found[plan.part.name] = grasps
    return found


def certify_missing(
    parts: Sequence[str], models: Path, workers: int, *, clearance: float = TABLE_CLEARANCE
) -> None:
    """Certify grasps of the parts that have none of today's, with the settings by default.

    A part of very many convex pieces gets fewer simulations, as in an assessment. Grasps of another number of
    simulations, of fewer resting poses, or of candidates of other networks remain, such as those of
    ``assess --quick``; those that another version of the simulation or of the certification measured, or
    under other conditions, are made again.

    Args:
        parts: Names or folders.
        models: Folder of the networks that choose candidates.
        workers: Processes; 0: one per core.
        clearance: Least distance of the pads from the cell's table, metres. Grasps that were certified for a
            smaller one are made again.
    """
    missing = [name for name in parts if not _of_today(find_part(name), clearance)]
    if not missing:
        return
    note(f"certifying grasps of {len(missing)} of {len(parts)} parts, some minutes each")
    alike: dict[int, list[str]] = {}
    for name in missing:
        simulations = round(CertifyConfig().simulations / hull_excess(find_part(name).n_hulls))
        alike.setdefault(simulations, []).append(name)
    for simulations, names in alike.items():
        config = certify_config(simulations, clearance=clearance)
        certify(names, config, models, process_count(workers))


def certify_config(
    simulations: int, *, factor: float = 1.0, clearance: float = TABLE_CLEARANCE, seed: int = 0
) -> CertifyConfig:
    """Settings of a part's certification by about so many simulations.

    Args:
        simulations: Simulated grasps.
        factor: How many times as likely the rarest resting pose with certified grasps must be as by default.
        clearance: Least distance of the pads from the table, metres.
        seed: Of the simulations.
    """
    usual = CertifyConfig()
    # A stream keeps one core busy: two, also of the only resting pose, if there are enough simulations.
    per_stream = simulations // 2 if simulations >= 2 * LEAST_STREAM else simulations
    return CertifyConfig(
        simulations=simulations,
        per_stream=min(usual.per_stream, per_stream),
        least_probability=usual.least_probability * factor,
        clearance=clearance,
        seed=seed,
    )


def _of_today(part: Part, clearance: float) -> bool:
    """Whether a part's certified grasps in the cache are measured as today's would be, and high enough."""
    try:
        known = read_certified(part).conditions
    except BadPart:
        return False
    now = CertifyConfig().model_dump(mode="json") | _VERSIONS
    made_by, least = known.get("versions"), known.get("clearance", TABLE_CLEARANCE)
    return (
        isinstance(made_by, dict)
        and made_by.get("simulation") == versions()["simulation"]
        and all(known.get(name) == now[name] for name in _MEASURED_BY)
        and isinstance(least, int | float)
        and least >= clearance
    )


@dataclass(frozen=True, kw_only=True)
class _Plan:
    """Streams of a part, and its resting poses that have none.

    Attributes:
        part: The part.
        streams: Of all its groups of resting poses.
        without: Reasons, by resting pose.
        like: As in `CertifiedGrasps`.
        stands: Likewise.
    """

    part: Part
    streams: tuple[Stream, ...]
    without: dict[int, str]
    like: dict[int, tuple[int, float]]
    stands: tuple[bool, ...]


def _plan(part: Part, config: CertifyConfig) -> _Plan:
    stands = resting_of(part, config.physics).stands
    if not any(stands):
        raise BadPart(f"'{part.name}' topples in the simulation in every resting pose; leave it out")
    which = {number: row for row, number in enumerate(i for i, one in enumerate(stands) if one)}
    like = {number: (other, turn) for number, (other, turn) in alike_poses(part).items() if other in which}
    groups: dict[int, list[Member]] = {}
    without = {}
    for number, share in enumerate(part.resting_probability):
        if number not in which:
            without[number] = "it topples in the simulation"
            continue
        first, turn = like.get(number, (number, 0.0))
        member = Member(which=which[number], turn=turn, probability=float(share))
        groups.setdefault(first, []).append(member)
    shares = {first: sum(one.probability for one in members) for first, members in groups.items()}
    # The likeliest pose of a part that may come to rest in many is not left out.
    least = min(config.least_probability, max(shares.values()))
    for first, share in shares.items():
        if share < least:
            without[first] = f"it is rare (probability {share:.1%}, the limit is {least:.0%})"
    kept = {first: share for first, share in shares.items() if first not in without}
    total = sum(share**0.5 for share in kept.values())
    n_streams = max(len(kept), round(config.simulations / config.per_stream))
    size = max(LEAST_STREAM, min(config.per_stream, config.simulations // n_streams))
    streams = [
        Stream(
            part=str(part.folder),
            resting=first,
            members=tuple(groups[first]),
            number=number,
            simulations=size,
        )
        for first, share in kept.items()
        for number in range(max(1, round(n_streams * share**0.5 / total)))
    ]
    return _Plan(part=part, streams=tuple(streams), without=without, like=like, stands=stands)


@contextmanager
def _certifier(settings: _Settings) -> Iterator[Callable[[Stream], Iterator[_Made | None]]]:
    from mskgrasp.simulation.shard import Simulator

    config = settings.config
    simulator = Simulator(config.physics, Overhead(), config.noise)
    lowest = lowest_grasp_z(TABLE_Z, config.clearance)
    planner = Planner(
        load_models(settings.models, "cpu"), PlannerConfig(), table_z=TABLE_Z, region=REGION,
        lowest_grasp_z=lambda xy: np.full(len(xy), lowest),
    )  # fmt: skip

    def certify_stream(stream: Stream) -> Generator[_Made | None, None, None]:
        grasps = yield from run_stream(simulator.load(stream.part), planner, stream, config)
        yield _Made(stream=stream, grasps=tuple(grasps))

    try:
        yield certify_stream
    finally:
        simulator.close()


def _stream_name(stream: Stream) -> str:
    return f"stream {stream.key} of part '{Path(stream.part).name}'"


def _conditions(config: CertifyConfig, models: Path) -> dict[str, Any]:
    return dict(
        config.model_dump(mode="json"),
        certify_version=CERTIFY_VERSION,
        versions=versions(),
        models=model_digests(models),
    )


def _stream_file(part: Part, stream: Stream, digest: str) -> Path:
    return certified_folder(part) / digest / f"{stream.key}.json"


def _write_stream(part: Part, made: _Made, digest: str) -> None:
    path = _stream_file(part, made.stream, digest)
    path.parent.mkdir(parents=True, exist_ok=True)
    values = [grasp.to_json() for grasp in made.grasps]
    write_whole(path, (json.dumps(values, allow_nan=False) + "\n").encode())


def _read_stream(part: Part, stream: Stream, digest: str) -> list[CertifiedGrasp] | None:
    """Grasps of a finished stream; None where it is missing or damaged."""
    try:
        values = json.loads(_stream_file(part, stream, digest).read_text(encoding="utf-8"))
        return [grasp_from_json(one, len(part.resting_probability)) for one in values]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None


def _merged(plan: _Plan, config: CertifyConfig, conditions: dict[str, Any], digest: str) -> CertifiedGrasps:
    grasps: list[CertifiedGrasp] = []
    uncertified: list[CertifiedGrasp] = []
    without = dict(plan.without)
    for resting in dict.fromkeys(stream.resting for stream in plan.streams):
        found = [
            grasp
            for stream in plan.streams
            if stream.resting == resting
            for grasp in _read_stream(plan.part, stream, digest) or ()
        ]
        selected = select_certified(plan.part, found, config)
        grasps += selected.certified
        uncertified += selected.uncertified
        if selected.reason:
            without[resting] = selected.reason
    return CertifiedGrasps(
        part=plan.part.name,
        part_hash=plan.part.content_hash,
        grasps=tuple(grasps),
        uncertified=tuple(uncertified),
        without=without,
        like=plan.like,
        stands=plan.stands,
        conditions=conditions,
    )

"""Built-in parts: their names and recipes, building them, and finding a part by its name."""

from __future__ import annotations

import difflib
import hashlib
import json
from functools import lru_cache
from pathlib import Path

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.parts import store
from mskgrasp.parts.names import LEGAL_NAME, legal_name
from mskgrasp.parts.part import SCHEMA_VERSION, Part
from mskgrasp.parts.recipes import cad, families
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids.one_thread import hold_manifold_to_one_thread
from mskgrasp.parts.versions import PART_VERSION, stamp
from mskgrasp.parts.write_solid import with_hulls, write_solid


def builtin_names() -> tuple[str, ...]:
    """Names of all parts with a recipe, sorted: the families, and with ``[cad]`` those drawn in CAD."""
    return tuple(sorted(_recipes()))


def starter_names() -> tuple[str, ...]:
    """Names of the starter set, sorted: 25 parts of 17 families, built in a few seconds."""
    return families.STARTER


@lru_cache(maxsize=1)
def _recipes() -> dict[str, Recipe]:
    found = dict(families.recipes())
    if cad.available():
        for recipe in cad.recipes():
            if recipe.name in found:
                raise BadPart(f"two recipes are called {recipe.name!r}: rename one")
            found[recipe.name] = recipe
    return found


def recipe_of(name: str) -> Recipe:
    """The recipe of a built-in part.

    Raises:
        BadPart: There is no such part.
    """
    recipe = _recipes().get(name)
    if recipe is None:
        raise unknown_part(name, builtin_only=True)
    return recipe


def build_part(name: str) -> Part:
    """Build a part from its recipe, unless the parts folder has it up to date.

    Raises:
        BadPart: There is no such recipe, or no set of hulls represents the shape closely enough.
    """
    recipe = recipe_of(name)
    if is_built(name):
        return store.read_part(store.parts_folder() / name)
    hold_manifold_to_one_thread()
    dimensions = {
        key.removesuffix("_mm"): value / 1000 if key.endswith("_mm") else value
        for key, value in recipe.dimensions.items()
    }
    return write_solid(
        with_hulls(recipe.make(recipe.dimensions)),
        name=name,
        family=recipe.family,
        source=recipe.source,
        licence=recipe.licence,
        density=recipe.density,
        dimensions=dimensions,
        recipe_hash=recipe_hash(name),
    )


def is_built(name: str) -> bool:
    """Whether the parts folder has a part, undamaged and built by the current recipe."""
    return store.stored_recipe_hash(store.parts_folder() / name) == recipe_hash(name)


def is_known(name: str) -> bool:
    """Whether a name is that of a built-in part or of one in the parts folder."""
    return name in _recipes() or bool(
        LEGAL_NAME.fullmatch(name) and store.is_stored(store.parts_folder() / name)
    )


def find_part(name_or_folder: str | Path) -> Part:
    """A part by its name or by its folder; a built-in one is built where it is missing.

    Raises:
        UnknownPart: There is no such part: the message lists similar names, or names the missing extra.
        BadPart: Its folder is damaged, or it cannot be built.
    """
    text = str(name_or_folder)
    if text in _recipes():
        try:
            return build_part(text)
        except BadPart as error:
            raise BadPart(f"{text}: {error}") from error
    if is_known(text):
        return store.read_part(store.parts_folder() / text)
    if Path(text).is_dir():
        return store.read_part(Path(text).absolute())  # a bare name of the folder could be another part's
    raise unknown_part(text)


def imported_names() -> tuple[str, ...]:
    """Names of the parts in the parts folder that are not built in, sorted."""
    root = store.parts_folder()
    found = (path.name for path in root.iterdir() if path.is_dir()) if root.is_dir() else ()
    builtin = _recipes()
    return tuple(sorted(name for name in found if LEGAL_NAME.fullmatch(name) and name not in builtin))


def unknown_part(name: str, *, builtin_only: bool = False) -> UnknownPart:
    """The error for a name that no part has, for a part whose extra is missing, or for a CAD file."""
    from mskgrasp.parts.importing.mesh_files import LOADERS  # the readers load slowly

    if Path(name).suffix.lower() in LOADERS:
        if Path(name).is_file():
            from mskgrasp.parts.importing.origin import import_command

            try:
                part = legal_name(Path(name).stem)
            except BadPart:
                part = ""  # of such a file none is made without --name
            if part in imported_names():
                command = import_command(Path(name), store.parts_folder() / part)
                return UnknownPart(
                    f"{name} is a CAD file: name the part {part}, or import the file, {command}"
                )
            return UnknownPart(
                f"{name} is a CAD file: import it, {import_command(Path(name))}, and name the part"
            )
        known = f", or name the part {Path(name).stem}" if Path(name).stem in _recipes() else ""
        return UnknownPart(f"there is no file {name}; check the path{known}")
    if not cad.available() and any(recipe.name == name for recipe in cad.recipes()):
        return UnknownPart(f"{name} is drawn in CAD, which needs an extra: run EXTRAS=dev,cad .ci/setup")
    known = builtin_names() if builtin_only else (*builtin_names(), *imported_names())
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    hint = (
        f"did you mean {', '.join(close)}?"
        if close
        else "`python -m mskgrasp.parts list` shows the parts, with --catalogue all"
    )
    kind = "built-in part" if builtin_only else "part or part folder"
    return UnknownPart(f"no {kind} is called {name!r}: {hint}")


def recipe_hash(name: str) -> str:
    """Digest of everything that determines a part: versions, dimensions, vendors' libraries."""
    recipe = recipe_of(name)
    module = recipe.make.__module__
    text = [
        SCHEMA_VERSION,
        stamp("part", PART_VERSION),
        stamp(".".join(module.split(".")[-2:]), recipe.version),
        cad.package_versions() if module.startswith(cad.__name__) else "",
        recipe.name,
        recipe.family,
        recipe.source,
        recipe.licence,
        recipe.density,
        recipe.dimensions,
    ]
    return hashlib.sha256(json.dumps(text, sort_keys=True).encode()).hexdigest()

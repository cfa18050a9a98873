"""checkout -> dist/*.zip.  The extension for each platform, with embreex's wheels, validated.

Blender 5.0 and later choose, among the wheels of a zip, those of their own Python; 4.2 to 4.5
cannot, so they get a zip of their own with the one wheel they need.  Blender left Intel Macs
after 4.5.  The same sources give the same bytes.
Runs inside the environment: Blender's own validator is part of the bpy module.
"""

import argparse
import fnmatch
import io
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path
from typing import NamedTuple

from .environment import COMMON, ROOT

EMBREEX = next(pin for pin in COMMON if pin.startswith("embreex=="))
# platform of Blender -> platform of the wheels
PLATFORMS = {
    "linux-x64": "manylinux_2_28_x86_64",
    "windows-x64": "win_amd64",
    "macos-arm64": "macosx_13_0_arm64",
    "macos-x64": "macosx_13_0_x86_64",
}
SHIPPED = ("__init__.py", "LICENSE", "README.md", "CHANGELOG.md", "core/", "addon/")
LEFT_OUT = ("addon/headless.py", "*.pyc", "*/__pycache__/*", "*/.*")
EPOCH = (1980, 1, 1, 0, 0, 0)


class Edition(NamedTuple):
    """A zip for some versions of Blender: which, the Pythons of their wheels, the platforms."""

    suffix: str
    pythons: tuple[str, ...]
    versions: str
    platforms: tuple[str, ...]


EDITIONS = (
    Edition(
        "",
        ("311", "313", "314"),
        'blender_version_min = "5.0.0"',
        ("linux-x64", "windows-x64", "macos-arm64"),
    ),
    Edition(
        "-py311",
        ("311",),
        'blender_version_min = "4.2.0"\nblender_version_max = "5.0.0"',
        tuple(PLATFORMS),
    ),
)


def sources() -> list[str]:
    """Return the files that Blender needs, as sorted paths below the checkout."""
    found = []
    for start in SHIPPED:
        path = ROOT / start
        found += [each for each in (path.rglob("*") if start.endswith("/") else [path])]
    names = sorted(each.relative_to(ROOT).as_posix() for each in found if each.is_file())
    return [n for n in names if not any(fnmatch.fnmatch(n, pattern) for pattern in LEFT_OUT)]


def manifest(edition: Edition, platform: str, wheels: list[Path]) -> str:
    """Return the extension's manifest as the zip has it: one platform, its wheels and versions."""
    text = (ROOT / "blender_manifest.toml").read_text("utf-8")
    text = re.sub(r"(?ms)^(# [^\n]*\n|\n)*\[build\].*?(?=^\[|\Z)", "", text)
    text = re.sub(r"(?m)^blender_version_(min|max) *=.*\n", "", text)
    head, table, tables = text.partition("\n[")
    names = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
    lines = f'{edition.versions}\nplatforms = ["{platform}"]\nwheels = [\n{names}]\n'
    return head.rstrip() + "\n" + lines + (table + tables if table else "")


def download(edition: Edition, platform: str, folder: Path) -> list[Path]:
    """Fetch embreex's wheels of one platform with pip, as configured here."""
    for python in edition.pythons:
        command = [sys.executable, "-I", "-m", "pip", "--disable-pip-version-check", "download"]
        command += ["--quiet", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
        command += ["--platform", PLATFORMS[platform], "--python-version", python]
        subprocess.run([*command, "--implementation", "cp", EMBREEX], check=True)
    return sorted(folder.iterdir())


def pack(target: Path, edition: Edition, platform: str) -> None:
    """Write one zip, at once and whole."""
    with tempfile.TemporaryDirectory() as scratch:
        wheels = download(edition, platform, Path(scratch))
        members = [(name, (ROOT / name).read_bytes()) for name in sources()]
        members.append(("blender_manifest.toml", manifest(edition, platform, wheels).encode()))
        members += [(f"wheels/{wheel.name}", wheel.read_bytes()) for wheel in wheels]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(members):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.external_attr = 0o644 << 16
            entry.create_system = 3
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    draft = target.with_suffix(".tmp")
    draft.write_bytes(buffer.getvalue())
    draft.replace(target)


def validator() -> Path:
    """Return Blender's own tool for extensions, which comes with the bpy module."""
    place = "bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
    return next(found for path in sys.path for found in Path(path).glob(place))


def validate(target: Path) -> None:
    """Let Blender's own validator look at a zip.  Raises CalledProcessError."""
    subprocess.run([sys.executable, "-I", str(validator()), "validate", str(target)], check=True)


def main(argv: list[str]) -> int:
    """Build and validate the zips of the platforms asked for, or of all."""
    parser = argparse.ArgumentParser(prog="dev.py build", description="Make the extension's zips.")
    known = ", ".join(PLATFORMS)
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=f"one of {known}")
    asked = parser.parse_args(argv).platforms or list(PLATFORMS)
    if unknown := set(asked) - set(PLATFORMS):
        parser.error(f"no platform {', '.join(sorted(unknown))}; there are {known}")
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text("utf-8"))["version"]
    folder = ROOT / "dist"
    folder.mkdir(exist_ok=True)
    for edition in EDITIONS:
        for platform in edition.platforms:
            if platform not in asked:
                continue
            target = folder / f"penumbra-{version}-{platform}{edition.suffix}.zip"
            try:
                pack(target, edition, platform)
                validate(target)
            except subprocess.CalledProcessError as error:
                target.unlink(missing_ok=True)
                what = "download" if "download" in error.cmd else "validate"
                print(f"dev.py build: {target.name} failed to {what}", file=sys.stderr)
                return 1
            print(f"{target} ({target.stat().st_size / 1e6:.0f} MB)", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

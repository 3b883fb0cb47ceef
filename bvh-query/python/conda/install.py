"""Installs a package for conda from a channel in a folder, which has only names in place of Python and numpy, and prints the folder of
its modules. Needs py-rattler and py-rattler-build.

    install.py PACKAGE PLATFORM PREFIX
"""

import asyncio
import pathlib
import shutil
import sys
import tempfile

import rattler
import rattler.index
import rattler_build

#: The oldest Python that the package asks for, and a numpy of it.
OTHERS = {"python": "3.10.0", "numpy": "1.24.0"}


async def install(package, platform, prefix, folder):
    channel = folder / "channel"
    (channel / platform).mkdir(parents=True)
    (channel / "noarch").mkdir()
    shutil.copy(package, channel / platform)
    for name, version in OTHERS.items():
        (folder / name).mkdir()
        (folder / name / f"{name}.txt").write_text("in place of the package\n")
        rattler_build.assemble_package(name, version, platform, "0", channel / platform, files_dir=folder / name)
    await rattler.index.index_fs(channel)
    records = await rattler.solve([f"file://{channel}"], ["cbvh"], platforms=[platform, "noarch"])
    await rattler.install(records, prefix, cache_dir=folder / "cache", platform=rattler.Platform(platform), show_progress=False)


def main(package, platform, prefix):
    with tempfile.TemporaryDirectory() as folder:
        asyncio.run(install(package, platform, prefix, pathlib.Path(folder)))
    found = [path.parent for path in pathlib.Path(prefix).rglob("cbvh/__init__.py")]
    if len(found) != 1:
        sys.exit(f"{package}: expected the module cbvh once in {prefix}, found {found}")
    print(found[0].parent)


if __name__ == "__main__":
    main(*sys.argv[1:])

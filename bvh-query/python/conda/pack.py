"""Makes a package for conda of a wheel, by the recipe beside this file, without a channel. Needs py-rattler-build.

    pack.py WHEEL PLATFORM FOLDER      such as linux-64; prints the path of the package, which gets the time SOURCE_DATE_EPOCH
"""

import bz2
import email
import io
import json
import os
import pathlib
import sys
import tarfile
import tempfile
import zipfile

import rattler_build

RECIPE = pathlib.Path(__file__).with_name("recipe.yaml")


def asked(wheel):
    """The version of the wheel, and what it asks of Python and of packages, as the recipe states it."""
    with zipfile.ZipFile(wheel) as archive:
        name, = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = email.message_from_bytes(archive.read(name))
    packages = [package.replace(">=", " >=", 1) for package in metadata.get_all("Requires-Dist", [])]
    return metadata["Version"], [f"python {metadata['Requires-Python']}", *packages]


def built(platform, folder):
    """Builds the recipe in a folder."""
    # In place of a channel of packages.
    (folder / "empty" / "noarch").mkdir(parents=True)
    (folder / "empty" / "noarch" / "repodata.json").write_text('{"packages": {}, "packages.conda": {}}')
    systems = rattler_build.PlatformConfig(target_platform=platform, host_platform=platform, build_platform="linux-64")
    variant, = rattler_build.Stage0Recipe.from_file(RECIPE).render(
        rattler_build.VariantConfig(), rattler_build.RenderConfig(platform=systems)
    )
    result = variant.run_build(
        channels=[f"file://{folder}/empty"], output_dir=folder / "output", package_format="tar.bz2", no_include_recipe=True
    )
    return pathlib.Path(result.packages[0])


def same_bytes(package, output, moment):
    """Writes the package as it is, in the order of names, without the time and the folder of this build."""
    with tarfile.open(package) as read, tarfile.open(fileobj=(plain := io.BytesIO()), mode="w", format=tarfile.PAX_FORMAT) as written:
        for member in sorted(read.getmembers(), key=lambda member: member.name):
            contents = read.extractfile(member).read() if member.isfile() else b""
            if member.name in ("info/index.json", "info/about.json"):
                facts = json.loads(contents)
                facts.pop("channels", None)
                if "timestamp" in facts:
                    facts["timestamp"] = moment * 1000
                contents = json.dumps(facts, indent=2, sort_keys=True).encode()
            entry = tarfile.TarInfo(member.name)
            entry.type, entry.mode, entry.linkname = member.type, member.mode, member.linkname
            entry.size, entry.mtime = len(contents), moment
            written.addfile(entry, io.BytesIO(contents))
    output.write_bytes(bz2.compress(plain.getvalue()))


def main(wheel, platform, output):
    wheel = pathlib.Path(wheel).resolve()
    version, needs = asked(wheel)
    os.environ["CBVH_WHEEL"] = str(wheel)
    with tempfile.TemporaryDirectory() as folder:
        package = built(platform, pathlib.Path(folder))
        found = rattler_build.Package.from_file(package)
        if (found.version, found.depends) != (version, needs):
            sys.exit(f"{RECIPE}: expected version {version} and {needs}, as in the wheel, found {found.version} and {found.depends}")
        path = pathlib.Path(output, package.name)
        same_bytes(package, path, int(os.environ["SOURCE_DATE_EPOCH"]))
    print(path)


if __name__ == "__main__":
    main(*sys.argv[1:])

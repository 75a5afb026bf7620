#!/usr/bin/env python3
"""Checks the layer table of docs/architecture.md from the #include lines, also through others. Exit 1 on a breach."""
import pathlib
import re
import subprocess
import sys

# Lowest line first. A folder may include what stands on a lower line of its own column.
CAPTURE = [
    {"firmware/protocol"}, {"acquisition/frame"}, {"acquisition/device"}, {"acquisition/session"},
    {"acquisition/camera"}, {"rig/description"}, {"rig/lamps"}, {"rig/capture"},
]
PROCESSING = [
    {"processing/maps"}, {"processing/calibration"}, {"processing/normals"}, {"processing/shading", "processing/texels"},
    {"processing/relight", "processing/transfer"}, {"processing/formats"}, {"processing/pipeline"},
]
FIRMWARE = [{"firmware/protocol"}, {"firmware/lampctl"}, {"firmware/board/atmega32u4", "firmware/board/host"}]
ROOTS = [{"sim"}, {"rig/health"}, {"rig/daemon"}, {"rig/cli"}]  # may include both columns
BRIDGES = {("processing/pipeline", "acquisition/session")}
FOLDERS = set().union(*CAPTURE, *PROCESSING, *FIRMWARE, *ROOTS)

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def folder_of(path):
    return next((f for f in FOLDERS if path.startswith(f + "/")), None)


def line_of(column, folder):
    return next((i for i, line in enumerate(column) if folder in line), None)


def allowed(source, target):
    if source == target or (source, target) in BRIDGES:
        return True
    root_line = line_of(ROOTS, source)
    if root_line is not None:
        target_line = line_of(ROOTS, target)
        return target_line is None or target_line < root_line
    if source.startswith("processing/") and target == "acquisition/frame":
        return True
    for column in (CAPTURE, PROCESSING, FIRMWARE):
        source_line, target_line = line_of(column, source), line_of(column, target)
        if source_line is not None and target_line is not None:
            return target_line < source_line
    return False


def reached(path, includes):
    """Every file of the project that `path` includes, with the chain that leads there."""
    chains, open_ends = {path: [path]}, [path]
    while open_ends:
        current = open_ends.pop()
        for target in includes.get(current, []):
            if target not in chains:
                chains[target] = chains[current] + [target]
                open_ends.append(target)
    del chains[path]
    return chains


def breaches(includes):
    for path in sorted(includes):
        source = folder_of(path)
        if source is None:
            continue
        for target, chain in reached(path, includes).items():
            folder = folder_of(target)
            if folder is None:
                yield f"{path} includes {target}, which is in no layer"
            elif not allowed(source, folder):
                yield f"{source} may not include {folder}: " + " -> ".join(chain)
            elif path.startswith("sim/") and folder.startswith("processing/") and not path.startswith("sim/truth."):
                yield "the simulator may not know the formulas it tests: " + " -> ".join(chain)


def main():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.cpp", "*.h"],
                            capture_output=True, text=True, check=True).stdout.split()
    files = {f for f in listed if not f.startswith("tests/") and pathlib.Path(f).exists()}
    includes = {f: [t for t in INCLUDE.findall(pathlib.Path(f).read_text()) if t in files] for f in files}
    missing = [f"{f} includes {t}, which is not a file from the project's root" for f in sorted(files)
               for t in INCLUDE.findall(pathlib.Path(f).read_text()) if t not in files]
    found = missing + list(breaches(includes))
    for breach in found:
        print("layers:", breach)
    print(f"layers: {len(files)} files, {len(found)} breaches")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

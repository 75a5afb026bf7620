#!/usr/bin/python3
"""Least-squares photometric stereo as one writes it with OpenCV and numpy: what darkbox is measured against.

usage: normals-numpy.py FOLDER OUT     FOLDER holds photographs and lights.lp; writes OUT/normals.png and albedo.png
"""
import pathlib
import sys

import cv2
import numpy as np

folder, out = map(pathlib.Path, sys.argv[1:])
lines = (folder / "lights.lp").read_text().split("\n")[1:]
names = [line.split()[0] for line in lines if line]
lights = np.array([[float(word) for word in line.split()[1:4]] for line in lines if line], np.float32)

rows = []
for name in names:
    image = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
    full = np.float32(65535 if image.dtype == np.uint16 else 255)
    rows.append(image.reshape(-1, 3).mean(axis=1, dtype=np.float32) / full)
shape = image.shape
grey = np.stack(rows)
g = np.linalg.pinv(lights) @ grey
length = np.linalg.norm(g, axis=0)
normal = (g / np.maximum(length, 1e-9)).T.reshape(shape)

out.mkdir(parents=True, exist_ok=True)
cv2.imwrite(str(out / "normals.png"), ((normal[..., ::-1] + 1) / 2 * 65535 + 0.5).astype(np.uint16))
cv2.imwrite(str(out / "albedo.png"), (np.clip(length, 0, 1).reshape(shape[:2]) * 255 + 0.5).astype(np.uint8))

#!/usr/bin/python3
"""Least-squares photometric stereo as one writes it with OpenCV and numpy: what darkbox is measured against.

usage: normals-numpy.py FOLDER OUT [--maps]
FOLDER holds photographs and lights.lp. Writes OUT/normals.png (16 bits) and albedo.png (grey, 8 bits). With --maps it
makes what darkbox makes: the albedo in colour, and the residual, the normals and the albedo also as floats (.npy,
uncompressed: the quickest there is).
"""
import pathlib
import sys

import cv2
import numpy as np

folder, out = map(pathlib.Path, sys.argv[1:3])
maps = "--maps" in sys.argv
lines = (folder / "lights.lp").read_text().split("\n")[1:]
names = [line.split()[0] for line in lines if line]
lights = np.array([[float(word) for word in line.split()[1:4]] for line in lines if line], np.float32)

rows, images = [], []
for name in names:
    image = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
    full = np.float32(65535 if image.dtype == np.uint16 else 255)
    if maps:
        images.append(image)
    rows.append(image.reshape(-1, 3).mean(axis=1, dtype=np.float32) / full)
shape = image.shape
grey = np.stack(rows)
g = np.linalg.pinv(lights) @ grey
length = np.linalg.norm(g, axis=0)
normal = (g / np.maximum(length, 1e-9)).T.reshape(shape)


out.mkdir(parents=True, exist_ok=True)
cv2.imwrite(str(out / "normals.png"), ((normal[..., ::-1] + 1) / 2 * 65535 + 0.5).astype(np.uint16))
albedo = length.reshape(shape[:2])
if maps:
    # Each channel's best factor of the shading that the normals give, and what the grey samples leave over.
    lit, error, weight = np.zeros(shape, np.float32), np.zeros(shape[:2], np.float32), np.zeros(shape[:2], np.float32)
    for image, row, light in zip(images, rows, lights):
        shading = (light @ g).reshape(shape[:2])
        error += (row.reshape(shape[:2]) - shading) ** 2
        np.maximum(shading, 0, out=shading)
        lit += image * (shading / full)[..., None]
        weight += shading * shading
    albedo = lit * (albedo / np.maximum(weight, 1e-9))[..., None]
    np.save(out / "normals.npy", normal)
    np.save(out / "albedo.npy", albedo[..., ::-1])
    np.save(out / "residual.npy", np.sqrt(error / len(names)))
cv2.imwrite(str(out / "albedo.png"), (np.clip(albedo, 0, 1) * 255 + 0.5).astype(np.uint8))

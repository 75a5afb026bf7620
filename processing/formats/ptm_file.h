#pragma once

#include <filesystem>
#include <vector>

#include "processing/relight/ptm.h"

namespace darkbox {

/// A polynomial texture map of display-encoded samples (1 = white) as a PTM 1.2 file (Malzbender, Gelb 2001,
/// "Polynomial Texture Map (.ptm) File Format"): PTM_FORMAT_RGB or PTM_FORMAT_LRGB, six scales, six biases, rows from
/// the bottom up, for every pixel the bytes of u^2, v^2, uv, u, v, 1; RGB has a block per channel, LRGB a second block
/// of colours. A viewer's sample is the sum of (byte - bias) scale times term, on 0...255. Quantised over the range of
/// each coefficient: an error of half its scale at most. Throws InputError when the file cannot be written.
void write_ptm(const std::filesystem::path& path, const Ptm& ptm);

/// The same as a folder for viewers in a browser (Relight, OpenLIME): info.json and plane_0.jpg, plane_1.jpg...; a
/// value is (sample - bias) scale with samples on 0...1, terms in the order 1, u, v, u^2, uv, v^2. RGB: one picture per
/// term. LRGB: the colour, then three terms to a picture. JPEG without chroma subsampling at `quality` (1...100).
/// `lights` are listed. Returns the pictures. Throws InputError when the folder cannot be written.
std::vector<std::filesystem::path> write_relight_web(const std::filesystem::path& folder, const Ptm& ptm,
                                                     const Lights& lights, int quality = 95);

}  // namespace darkbox

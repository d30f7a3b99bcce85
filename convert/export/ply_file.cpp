// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_files.h"

#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc {

namespace {

constexpr size_t kRows = 4096; // rows that are written at once
constexpr size_t kDigits = 20; // digits of the largest count of Gaussians, to which the header's count is padded

float logit(float opacity)
{
    const float inside = std::clamp(opacity, 1e-6f, 1 - 1e-6f);
    return std::log(inside / (1 - inside));
}

} // namespace

std::string gaussianPlyHeader(int degree, uint64_t count)
{
    const size_t rest = shValues(degree) - 1; // colour coefficients of a channel above degree 0
    const std::string number = std::to_string(count);
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + number + "\n";
    const auto property = [&header](const std::string& name) { header += "property float " + name + "\n"; };
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
        property(name);
    for (size_t i = 0; i < 3 * rest; ++i)
        property("f_rest_" + std::to_string(i));
    for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        property(name);
    return header + "comment gsc" + std::string(kDigits - number.size(), ' ') + "\nend_header\n";
}

void writeGaussianPlyRows(const GaussianSet& set, const PieceSink& write)
{
    const size_t rest = shValues(set.degree) - 1;
    std::vector<float> rows;
    for (size_t first = 0; first < set.size(); first += kRows) {
        rows.clear();
        for (size_t i = first; i < std::min(first + kRows, set.size()); ++i) {
            const float* color = set.color.data() + i * set.colorValues();
            rows.insert(rows.end(), set.position.data() + 3 * i, set.position.data() + 3 * i + 3);
            rows.insert(rows.end(), 3, 0.0f); // three zeros for the normals, which no viewer reads
            rows.insert(rows.end(), color, color + 3);
            for (size_t channel = 0; channel < 3; ++channel)
                for (size_t k = 1; k <= rest; ++k)
                    rows.push_back(color[3 * k + channel]);
            rows.push_back(logit(set.opacity[i]));
            rows.insert(rows.end(), set.log_scale.data() + 3 * i, set.log_scale.data() + 3 * i + 3);
            rows.insert(rows.end(), set.rotation.data() + 4 * i, set.rotation.data() + 4 * i + 4);
        }
        write(std::as_bytes(std::span(rows)));
    }
}

void writeGaussianPly(const GaussianSet& set, const PieceSink& write)
{
    const std::string header = gaussianPlyHeader(set.degree, set.size());
    write(std::as_bytes(std::span(header)));
    writeGaussianPlyRows(set, write);
}

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
// Figures of a page as files, drawn by the scripts of the page.
#pragma once

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace gsc {

struct FigureFile {
    std::string name; // such as "walk-accuracy.svg"
    std::string bytes;
};

bool hasFigures(); // false in a build without the libraries that draw figures

// Throws Error(Unsupported), in the words of --figures, if hasFigures() is false.
void requireFigures();

// SVG and PNG of every figure of every panel, in light colours. Throws Error: as requireFigures(); Internal (a script
// failed), OutOfMemory, Interrupted.
std::vector<FigureFile> drawFigures(const nlohmann::ordered_json& model,
                                    const std::function<void(size_t done, size_t total)>& progress);

} // namespace gsc

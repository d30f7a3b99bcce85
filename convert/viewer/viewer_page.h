// SPDX-License-Identifier: Apache-2.0
// Makes a page that shows a model of Gaussians in any browser with WebGL2.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <span>
#include <string>

namespace gsc {

// One HTML file that needs no other file. Equal input gives equal bytes. `sog`: a SOG file. `model`: JSON object of
// which page/viewer.js reads these keys:
//   name, version, at           texts; `at` is the camera whose view the model is, or null
//   gaussians                   as in schemas/export-report.schema.json
//   bytes                       size of the SOG file
//   background                  red, green, blue, each 0 to 1
//   cameras                     {name, position, rotation, width, height, fov_x, fov_y} as in a trajectory; one or more
//   first                       index in `cameras` of the camera that is shown first
std::string viewerPage(const nlohmann::ordered_json& model, std::span<const std::byte> sog);

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
// The files of page/ and the library PlayCanvas, which are part of the program.
#pragma once

#include <string_view>

namespace gsc {

std::string_view viewerTemplate(); // page/viewer.html, with the marks that viewer_page.cpp replaces
std::string_view viewerStyle();
std::string_view viewerScript();
std::string_view playcanvasScript();
std::string_view playcanvasLicence();

} // namespace gsc

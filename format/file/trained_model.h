// SPDX-License-Identifier: Apache-2.0
// Trained models that a program takes in place of a .gsc: it converts them into a temporary file.
#pragma once

#include "format/file/temporary.h"

#include <string>

namespace gsc {

// Returns true for what `gsc convert` reads: a folder, or a file that begins as a PLY does.
bool isTrainedModel(const std::string& path);

// Place of a temporary .gsc, in a folder of its own below TMPDIR. The destructor removes both; what a killed program
// left goes when the next one comes.
class TemporaryGsc {
public:
    explicit TemporaryGsc(const std::string& model); // the file is named as `model`; throws Error(Io)
    [[nodiscard]] const std::string& path() const { return m_path; }

private:
    Temporary m_folder;
    std::string m_path;
};

} // namespace gsc

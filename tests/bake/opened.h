// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>

#include <string>

namespace gsc::test {

// A file and what lies in it, checked in full.
struct Opened {
    explicit Opened(const std::string& path) : file(path, throwFirstIssue(path))
    {
        openGsc(file.bytes(), view, GscCheck::Full, throwFirstIssue(path));
    }
    GscFile file;
    GscView view;
};

} // namespace gsc::test

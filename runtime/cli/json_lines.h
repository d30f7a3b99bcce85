// SPDX-License-Identifier: Apache-2.0
// A file of JSON lines that another program may read while it is being written.
#pragma once

#include "runtime/cli/json.h"

#include <cstdio>
#include <string>
#include <string_view>

namespace gsc {

class JsonLines {
public:
    // Creates the file, or replaces an old one; an empty path = no file. Unlike other outputs it is written under its
    // own name from the start, so that a reader gets each line at once. Throws Error(Io).
    JsonLines(const std::string& path, bool overwrite);
    ~JsonLines();
    JsonLines(const JsonLines&) = delete;
    JsonLines& operator=(const JsonLines&) = delete;

    [[nodiscard]] bool open() const { return m_file != nullptr; }
    // appends a line to the file at once; does nothing without a file. Throws Error(Io)
    void add(const OrderedJson& line);
    void close(); // closes the file; no line can be added afterwards

private:
    std::string m_path;
    std::FILE* m_file = nullptr;
};

// Throws Error if the file cannot be written: `path` is the file `model` or `cameras` ("stored" = none), or exists and
// `overwrite` is false.
void checkJsonLines(const std::string& path, bool overwrite, const std::string& model, const std::string& cameras);

} // namespace gsc

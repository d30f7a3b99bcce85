// SPDX-License-Identifier: Apache-2.0
// A file of JSON lines that may be followed while it is written.
#pragma once

#include "runtime/cli/json.h"

#include <cstdio>
#include <string>
#include <string_view>

namespace gsc {

class JsonLines {
public:
    // Begins the file anew; empty = none. Throws Error(Io). No temporary file stands for it, as elsewhere: whoever follows
    // reads each line as it comes.
    JsonLines(const std::string& path, bool overwrite);
    ~JsonLines();
    JsonLines(const JsonLines&) = delete;
    JsonLines& operator=(const JsonLines&) = delete;

    [[nodiscard]] bool open() const { return m_file != nullptr; }
    void add(const OrderedJson& line); // in the file at once, unless there is none. Throws Error(Io)
    void close();                      // it takes no more

private:
    std::string m_path;
    std::FILE* m_file = nullptr;
};

// Checks that such a file may be written: it is not `model` or `cameras` ("stored" = none), and an old file may be
// replaced. Throws Error.
void checkJsonLines(const std::string& path, bool overwrite, const std::string& model, const std::string& cameras);

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <memory>
#include <string>

namespace gsc::fake_xr {

__attribute__((format(printf, 1, 2))) std::string formatString(const char* format, ...);
std::string quoted(const std::string& text); // as JSON

// A file of JSON lines, each complete at once, so that a test can read it while the application runs or after it died.
class Log {
public:
    // Starts a new file; goes on with it if it is the one that is open, as for a second instance of the process.
    void open(const std::string& path);
    [[nodiscard]] bool isOpen() const { return m_file != nullptr; }
    void line(const std::string& json);

private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, Close> m_file;
    std::string m_path;
};

} // namespace gsc::fake_xr

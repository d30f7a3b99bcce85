// SPDX-License-Identifier: Apache-2.0
// write_tiny_gsc FILE [appearance rows [cameras [levels [metre]]]]: a small valid model for tests that need a file.
#include "tests/format/tiny_gsc.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

int main(int argc, char** argv)
{
    if (argc < 2) {
        std::fprintf(stderr, "usage: write_tiny_gsc FILE [APPEARANCE_ROWS [CAMERAS [LEVELS [METRE]]]]\n");
        return 1;
    }
    gsc::test::TinyGscOptions options;
    options.appearance_rows = argc > 2 ? uint32_t(std::atoi(argv[2])) : 0;
    options.appearance_dim = options.appearance_rows > 0 ? 4 : 0;
    options.cameras = argc > 3 ? uint32_t(std::atoi(argv[3])) : 3;
    options.levels = argc > 4 ? uint32_t(std::atoi(argv[4])) : 1;
    if (argc > 5) // world units
        options.manifest = std::string(R"({"model":{"metre":{"units":)") + argv[5] + R"(,"rule":"a test says so"}}})";
    const std::vector<std::byte> bytes = gsc::test::tinyGsc(options);
    std::ofstream stream(argv[1], std::ios::binary);
    stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    return stream.good() ? 0 : 1;
}

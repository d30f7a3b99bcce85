// SPDX-License-Identifier: Apache-2.0
// Time and size of pictures as PNG of 8 bits, on one thread.
//
//   bench_png PICTURE...
//
// The best of nine, so that a busy machine tells less.
#include "kernels/threads/stopwatch.h"
#include "runtime/image/image_io.h"
#include "runtime/image/png_file.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <span>
#include <string>
#include <vector>

using namespace gsc;

namespace {

void measure(const std::string& path)
{
    const Image image = readImage(path);
    double encode_ms = 1e30, decode_ms = 1e30;
    size_t bytes = 0;
    Stopwatch watch;
    for (int i = 0; i < 9; ++i) {
        watch.lap();
        const std::vector<unsigned char> file = encodePng(image, PixelDepth::Eight);
        encode_ms = std::min(encode_ms, watch.lap());
        (void)decodePng(std::as_bytes(std::span(file)), path);
        decode_ms = std::min(decode_ms, watch.lap());
        bytes = file.size();
    }
    std::printf("%s: %ux%u, %zu bytes, written in %.1f ms, read in %.1f ms\n", path.c_str(), image.width, image.height,
                bytes, encode_ms, decode_ms);
}

} // namespace

int main(int argc, char** argv)
{
    try {
        for (int i = 1; i < argc; ++i)
            measure(argv[i]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}

// SPDX-License-Identifier: Apache-2.0
// Costs of archives: bytes an anchor, and megabytes of runtime file per second that one thread packs and unpacks.
//
//   bench_archive FILE.gsc...      runtime files; each is packed into the folder for temporary files
//
// Unpacking is what a player does before it opens the file, from a warm page cache: decoding into fresh memory, checksums
// included; the best of seven, so that a busy machine tells less.
#include "format/archive/archive.h"
#include <gsc/error.h>
#include <gsc/file/mapped_file.h>
#include <gsc/gsc_file.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <vector>

using namespace gsc;

namespace {

void measure(const std::string& path, const std::string& packed)
{
    const MappedFile file(path);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Full, throwFirstIssue(path));
    ArchiveOptions options;
    options.threads = 1;
    Stopwatch watch;
    const ArchiveSizes sizes = writeArchive(file.bytes(), view, packed, true, options, [](uint64_t, uint64_t) {});
    const double pack_ms = watch.lap();
    double best_ms = 1e30;
    bool same = true;
    for (int i = 0; i < 7; ++i) {
        watch.lap();
        const GscFile unpacked(packed, throwFirstIssue(packed), GscFile::Read::All, 1);
        best_ms = std::min(best_ms, watch.lap());
        same = same && std::ranges::equal(unpacked.bytes(), file.bytes());
    }
    if (!same)
        throw internalError(path, "unpacked to other bytes", "its own");
    const double megabytes = double(sizes.raw_bytes) * 1e-6, anchors = double(view.header->anchor_count);
    std::printf("%-40s %6.1f of %6.1f bytes an anchor, packs %5.0f, unpacks %5.0f MB/s\n",
                std::filesystem::path(path).filename().c_str(), double(sizes.stored_bytes) / anchors,
                double(sizes.raw_bytes) / anchors, megabytes / pack_ms * 1e3, megabytes / best_ms * 1e3);
}

} // namespace

int main(int argc, char** argv)
{
    const std::string packed = (std::filesystem::temp_directory_path() / "bench_archive.gsc").string();
    try {
        for (int i = 1; i < argc; ++i)
            measure(argv[i], packed);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    std::filesystem::remove(packed);
    return 0;
}

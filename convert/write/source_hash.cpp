// SPDX-License-Identifier: Apache-2.0
#include "convert/write/source_hash.h"

#include "convert/input/input_file.h"
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <vector>

namespace gsc {

namespace {

void hashFile(const std::string& path, const std::stop_token& stop, Checksum64& checksum, uint64_t& bytes)
{
    const InputFile file(path);
    std::vector<std::byte> buffer(1 << 20);
    for (uint64_t at = 0; at < file.bytes();) {
        throwIfInterrupted();
        if (stop.stop_requested())
            throw Error(ErrorCode::Interrupted, path, "its checksum is not wanted any more", "to be read to its end",
                        "run the command again");
        const std::span part = std::span(buffer).first(size_t(std::min<uint64_t>(buffer.size(), file.bytes() - at)));
        file.read(at, part);
        checksum.update(part);
        at += part.size();
    }
    bytes += file.bytes();
}

} // namespace

SourceHash hashSources(const Checkpoint& checkpoint, const std::stop_token& stop)
{
    SourceHash result;
    Checksum64 checksum;
    if (!checkpoint.ply_path.empty())
        hashFile(checkpoint.ply_path, stop, checksum, result.bytes);
    for (const std::string& path : checkpoint.weight_paths)
        hashFile(path, stop, checksum, result.bytes);
    result.hash = checksum.digest();
    return result;
}

} // namespace gsc

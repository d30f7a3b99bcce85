// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/source_hash.h"

#include "format/checksum.h"
#include "format/error.h"
#include "format/interrupt.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace gsc {

namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

void hashFile(const std::string& path, Checksum64& checksum, uint64_t& bytes)
{
    const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
    if (!file)
        throw Error(ErrorCode::Io, formatString("%s: cannot open: %s", path.c_str(), std::strerror(errno)));
    std::setvbuf(file.get(), nullptr, _IONBF, 0);
    std::vector<std::byte> buffer(1 << 20);
    while (const size_t got = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
        throwIfInterrupted();
        checksum.update(std::span(buffer).first(got));
        bytes += got;
    }
    if (std::ferror(file.get()))
        throw Error(ErrorCode::Io, formatString("%s: cannot read: %s", path.c_str(), std::strerror(errno)));
}

} // namespace

SourceHash hashSources(const Checkpoint& checkpoint)
{
    SourceHash result;
    Checksum64 checksum;
    if (!checkpoint.ply_path.empty())
        hashFile(checkpoint.ply_path, checksum, result.bytes);
    for (const std::string& path : checkpoint.weight_paths)
        hashFile(path, checksum, result.bytes);
    result.hash = checksum.digest();
    return result;
}

} // namespace gsc

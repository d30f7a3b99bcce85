// SPDX-License-Identifier: Apache-2.0
// PLY bytes: whatever the header promises, nothing but an Error may come of it.
#include "convert/input/checkpoint_model.h"
#include "convert/input/ply_reader.h"
#include <gsc/error.h>
#include "tests/fuzz/input_seeds.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace {

std::string seed(const char* second_group, const char* obj_info)
{
    std::string header = "ply\nformat binary_little_endian 1.0\n" + std::string(obj_info) + "element vertex 3\n";
    const std::string columns =
        std::string("x y z ") + second_group +
        "f_offset_0 f_offset_1 f_offset_2 f_anchor_feat_0 f_anchor_feat_1 opacity scale_0 scale_1 scale_2 scale_3 "
        "scale_4 scale_5 rot_0 rot_1 rot_2 rot_3 ";
    size_t count = 0;
    for (size_t i = 0; i < columns.size(); ++count) {
        const size_t end = columns.find(' ', i);
        header += "property float " + columns.substr(i, end - i) + "\n";
        i = end + 1;
    }
    std::string body;
    for (size_t i = 0; i < 3 * count; ++i) {
        const float value = float(i % 3);
        body.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    return header + "end_header\n" + body;
}

// The bytes as a file, since the scan of the levels reads one.
class MemoryFile {
public:
    MemoryFile(const uint8_t* data, size_t size) : m_fd(::memfd_create("fuzz.ply", MFD_CLOEXEC))
    {
        if (m_fd < 0 || ::write(m_fd, data, size) != ssize_t(size))
            std::abort();
    }
    ~MemoryFile() { ::close(m_fd); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(m_fd); }

private:
    int m_fd;
};

// Reads a PLY as readCheckpoint() does before it looks at any other file.
void readModel(const uint8_t* data, size_t size)
{
    const MemoryFile file(data, size);
    const gsc::PlyFile ply(file.path());
    gsc::Checkpoint checkpoint;
    checkpoint.family = gsc::detectFamily(ply.header(), ply.path());
    const gsc::AnchorColumns columns = gsc::findAnchorColumns(ply.header(), ply.path());
    if (ply.header().row_count == 0)
        return; // refused by readCheckpoint()
    checkpoint.ply_path = ply.path();
    checkpoint.anchor_count = ply.header().row_count;
    checkpoint.feat_dim = uint32_t(columns.feature.size());
    checkpoint.n_offsets = uint32_t(columns.offset.size() / 3);
    gsc::readLevels(checkpoint, ply, columns, {}, {});
    const bool has_levels = checkpoint.flags & gsc::kModelHasLevels;
    if (has_levels != !columns.level.empty() || checkpoint.level_min < 0 ||
        checkpoint.level_clamp > gsc::kMaxAnchorLevel || (has_levels && !(checkpoint.standard_dist > 0)))
        std::abort();
}

} // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv)
{
    gsc::test::addSeeds(argc, argv,
                        {seed("nx ny nz ", ""), seed("level extra_level info ", ""),
                         seed("level extra_level ", "obj_info standard_dist 1.5\nobj_info levels 3.0\n"),
                         seed("info ", ""), seed("", "")});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
    try {
        const gsc::PlyHeader header = gsc::parsePlyHeader(bytes, size, "fuzz.ply");
        // the parser's promise: the rows lie in the file; elements behind them may follow
        if (header.header_bytes > size || header.row_bytes == 0 ||
            header.row_count > (size - header.header_bytes) / header.row_bytes)
            std::abort();
        const size_t row_bytes = size_t(header.row_count * header.row_bytes);
        const gsc::AnchorColumns columns = gsc::findAnchorColumns(header, "fuzz.ply");
        for (const uint32_t fields : {uint32_t(gsc::kAnchorPlacement), uint32_t(gsc::kAnchorAll)}) {
            gsc::AnchorBatch batch;
            gsc::sizeBatch(batch, columns, fields, size_t(header.row_count));
            gsc::decodeAnchorRows(bytes.subspan(header.header_bytes, row_bytes), header.row_bytes, columns, fields, 0,
                                  batch, 0, "fuzz.ply");
            for (const int32_t level : batch.level)
                if (level < 0 || level > gsc::kMaxAnchorLevel)
                    std::abort();
        }
    } catch (const gsc::Error&) {
    }
    try {
        readModel(data, size);
    } catch (const gsc::Error&) {
    }
    return 0;
}

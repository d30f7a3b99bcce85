// SPDX-License-Identifier: Apache-2.0
#include "convert/write/spatial_index.h"

#include <gsc/error.h>
#include "runtime/module/load_module.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <nanovdb/util/NanoToOpenVDB.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <sstream>

namespace gsc {

namespace {

// Zeroed memory for NanoVDB's converter, which leaves unused parts of its nodes as they are: a file must not depend on
// what was in memory before.
class ZeroedBuffer {
public:
    static ZeroedBuffer create(uint64_t bytes, const ZeroedBuffer* = nullptr)
    {
        constexpr uint64_t kAlign = NANOVDB_DATA_ALIGNMENT;
        ZeroedBuffer buffer;
        buffer.m_bytes.reset(static_cast<uint8_t*>(std::aligned_alloc(kAlign, alignUp(bytes, kAlign))));
        if (!buffer.m_bytes)
            throw std::bad_alloc();
        std::memset(buffer.m_bytes.get(), 0, bytes);
        buffer.m_size = bytes;
        return buffer;
    }

    [[nodiscard]] const uint8_t* data() const { return m_bytes.get(); }
    uint8_t* data() { return m_bytes.get(); }
    [[nodiscard]] uint64_t size() const { return m_size; }
    [[nodiscard]] bool empty() const { return m_size == 0; }
    void clear()
    {
        m_bytes.reset();
        m_size = 0;
    }

private:
    struct Free {
        void operator()(uint8_t* p) const { std::free(p); }
    };
    std::unique_ptr<uint8_t, Free> m_bytes;
    uint64_t m_size = 0;
};

openvdb::MaskGrid::Ptr buildMask(const LevelRecord& level, PositionEncoding encoding, std::span<const LeafBuild> leaves,
                                 void (*check)())
{
    const auto grid = openvdb::MaskGrid::create(false);
    grid->setName(formatString("level_%d", level.level));
    // cell c covers the quanta c * w .. c * w + w - 1, but the centre of OpenVDB's voxel c lies at c
    const double width = double(1u << level.cell_log2), quantum = level.quantum;
    const double middle = encoding == PositionEncoding::Grid ? (width - 1) / 2 : width / 2;
    if (width * quantum < kLeastCell)
        throw Error(ErrorCode::Unsupported, formatString("level %d", level.level),
                    formatString("its largest cell is %g world units wide", width * quantum),
                    formatString("at least %g", kLeastCell), "scale the scene up");
    const auto transform = openvdb::math::Transform::createLinearTransform(width * quantum);
    transform->postTranslate(openvdb::Vec3d(double(level.origin) + middle * quantum));
    grid->setTransform(transform);

    openvdb::MaskGrid::Accessor accessor = grid->getAccessor();
    size_t done = 0;
    for (const LeafBuild& build : leaves) {
        if (done++ % 65536 == 0)
            check();
        const int32_t* origin = build.record.origin;
        auto* leaf = accessor.touchLeaf(openvdb::Coord(origin[0], origin[1], origin[2]));
        openvdb::MaskGrid::TreeType::LeafNodeType::NodeMaskType mask;
        for (openvdb::Index word = 0; word < 8; ++word)
            mask.getWord<openvdb::Index64>(word) = build.cells[word];
        leaf->setValueMask(mask);
    }
    return grid;
}

} // namespace

std::vector<std::byte> buildNanoVdb(const LevelRecord& level, PositionEncoding encoding, std::span<LeafBuild> leaves,
                                    void (*check)())
{
    const openvdb::MaskGrid::Ptr mask = buildMask(level, encoding, leaves, check);
    nanovdb::OpenToNanoVDB<openvdb::ValueMask, nanovdb::ValueMask, nanovdb::AbsDiff, ZeroedBuffer> converter;
    converter.setStats(nanovdb::StatsMode::BBox);
    converter.setChecksum(nanovdb::ChecksumMode::Full);
    const auto handle = converter(*mask);

    const auto* grid = handle.grid<nanovdb::ValueMask>();
    if (!grid)
        throw internalError("nanovdb", "made no mask grid", "one");
    const uint32_t count = grid->tree().nodeCount(0);
    const auto* first = grid->tree().getFirstNode<0>();
    const auto accessor = grid->getAccessor();
    for (LeafBuild& build : leaves) {
        const int32_t* origin = build.record.origin;
        const auto* leaf = accessor.probeLeaf(nanovdb::Coord(origin[0], origin[1], origin[2]));
        if (!leaf)
            throw internalError("nanovdb",
                                formatString("lost the leaf at cell %d %d %d", origin[0], origin[1], origin[2]),
                                "every leaf");
        build.record.nanovdb_index = uint32_t(leaf - first);
    }
    if (count != leaves.size() || handle.size() % NANOVDB_DATA_ALIGNMENT != 0)
        throw internalError("nanovdb",
                            formatString("made %u leaves and %llu bytes", count, (unsigned long long)handle.size()),
                            formatString("%zu leaves and aligned bytes", leaves.size()));
    const auto* bytes = reinterpret_cast<const std::byte*>(handle.data());
    return {bytes, bytes + handle.size()};
}

std::string openVdbFile(std::span<const std::byte* const> grids, uint64_t id, void (*check)())
{
    openvdb::GridCPtrVec copies;
    for (const std::byte* grid : grids) {
        check();
        copies.push_back(nanovdb::nanoToOpenVDB(*reinterpret_cast<const nanovdb::NanoGrid<nanovdb::ValueMask>*>(grid)));
    }
    std::ostringstream out;
    openvdb::io::Stream stream(out);
    // no other compression, because mask leaves have no values
    stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(copies);
    std::string bytes = std::move(out).str();
    // byte 21, behind a magic number, three versions and a flag, holds a UUID in hexadecimal with dashes; it is
    // replaced
    const std::string uuid =
        formatString("%08x-%04x-4%03x-8000-%012llx", unsigned(id >> 32), unsigned(id >> 16 & 0xffff),
                     unsigned(id >> 4 & 0xfff), static_cast<unsigned long long>(id & 0xffffffffffff));
    constexpr size_t kUuidAt = 21;
    if (bytes.size() < kUuidAt + 36 || bytes[kUuidAt + 8] != '-' || bytes[kUuidAt + 23] != '-')
        throw internalError("openvdb", "wrote a file without a UUID at byte 21", "one there");
    return bytes.replace(kUuidAt, uuid.size(), uuid);
}

namespace {

constexpr SpatialIndexFunctions kFunctions{buildNanoVdb, openVdbFile};

} // namespace

} // namespace gsc

GSC_EXPORT_MODULE(gsc::kFunctions)

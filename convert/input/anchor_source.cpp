// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint.h"

#include "convert/input/ply_reader.h"
#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

// Bytes of the PLY that are read at once: enough for any disk to be fast, few enough to stay in the last-level cache
// until they are decoded.
constexpr size_t kBlockBytes = 8u << 20;
// Bytes of a block that are decoded at once: they stay in the first-level caches, because each field is a pass over the
// rows.
constexpr size_t kPieceBytes = 128u << 10;

class PlyAnchorSource final : public AnchorSource {
public:
    explicit PlyAnchorSource(const Checkpoint& checkpoint)
        : m_file(checkpoint.ply_path), m_columns(findAnchorColumns(m_file.header(), checkpoint.ply_path))
    {
        if (m_file.header().row_count != checkpoint.anchor_count || m_columns.feature.size() != checkpoint.feat_dim ||
            m_columns.offset.size() != 3 * size_t(checkpoint.n_offsets))
            throw Error(ErrorCode::Io, checkpoint.ply_path, "changed since the checkpoint was read", "the same file",
                        "run the command again");
        m_block_rows = std::max<size_t>(1, kBlockBytes / m_file.header().row_bytes);
    }

    bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) override
    {
        const uint64_t rows = std::min<uint64_t>(max_rows, m_file.header().row_count - m_next);
        batch.first = m_next;
        sizeBatch(batch, m_columns, fields, size_t(rows));
        const size_t row_bytes = m_file.header().row_bytes;
        const size_t piece_rows = std::max<size_t>(1, kPieceBytes / row_bytes);
        for (size_t done = 0; done < rows;) {
            if (m_next == m_block_first + m_block.size() / row_bytes)
                fill();
            const size_t in_block = size_t(m_next - m_block_first);
            const size_t count = std::min({size_t(rows) - done, m_block.size() / row_bytes - in_block, piece_rows});
            decodeAnchorRows({m_block.data() + in_block * row_bytes, count * row_bytes}, uint32_t(row_bytes), m_columns,
                             fields, m_next, batch, done, m_file.path());
            done += count;
            m_next += count;
        }
        return rows != 0;
    }

    void rewind() override
    {
        m_next = 0;
        m_block_first = 0;
        m_block.clear();
    }

private:
    // Reads the block of rows that starts at row m_next and asks the kernel to read the next block ahead.
    void fill()
    {
        const uint64_t total = m_file.header().row_count;
        const uint64_t count = std::min<uint64_t>(m_block_rows, total - m_next);
        m_block_first = m_next;
        m_block.resize(size_t(count) * m_file.header().row_bytes);
        m_file.readRows(m_next, m_block);
        const uint64_t after = m_next + count;
        m_file.prefetchRows(after, std::min<uint64_t>(m_block_rows, total - after));
    }

    PlyFile m_file;
    AnchorColumns m_columns;
    size_t m_block_rows = 0;
    std::vector<std::byte> m_block;
    uint64_t m_block_first = 0; // row number of the first row in the block
    uint64_t m_next = 0;        // number of the next row that next() returns
};

} // namespace

std::unique_ptr<AnchorSource> openAnchors(const Checkpoint& checkpoint)
{
    return std::make_unique<PlyAnchorSource>(checkpoint);
}

} // namespace gsc

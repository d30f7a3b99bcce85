// SPDX-License-Identifier: Apache-2.0
#include <gsc/scene.h>

#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>
#include "format/machine/machine.h"
#include "kernels/math/anchor.h"
#include <gsc/camera.h>
#include "runtime/model/local_model.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include <sys/mman.h>
#include <unistd.h>

namespace gsc {

namespace {

// Asks the system to read the anchors before the first frame, if they leave memory for other programs.
void prefetch(std::span<const std::byte> anchors)
{
    const long page = sysconf(_SC_PAGESIZE);
    if (page <= 0 || anchors.size() > usableMemory() / 2)
        return;
    // sections are aligned to 4096 bytes, but on a machine with larger pages the address must be rounded down to a
    // page
    const auto address = reinterpret_cast<uintptr_t>(anchors.data());
    const uintptr_t start = address / uintptr_t(page) * uintptr_t(page);
    // only advice: a failure costs speed, nothing else
    (void)posix_madvise(reinterpret_cast<void*>(start), anchors.size() + (address - start), POSIX_MADV_WILLNEED);
}

class MappedScene : public Scene {
public:
    MappedScene(std::shared_ptr<const GscFile> file, const std::string& path, bool verify_payloads)
        : m_path(path), m_file(std::move(file))
    {
        openGsc(m_file->bytes(), m_gsc, verify_payloads ? GscCheck::Full : GscCheck::Index, throwFirstIssue(m_path));
        if (!m_file->isArchive())
            prefetch(m_gsc.anchors);
        m_manifest.assign(m_gsc.manifest);
        m_arrays.reserve(m_gsc.chunks.size());
        for (const ChunkRecord& chunk : m_gsc.chunks)
            m_arrays.push_back(chunkArrays(*m_gsc.params, chunk.anchor_count, chunkPayload(m_gsc, chunk).data()));
        for (const CameraRecord& record : m_gsc.cameras)
            m_cameras.push_back(sourceCamera(record, m_gsc.camera_names));
        m_view.params = m_gsc.params;
        m_view.levels = m_gsc.levels.data();
        m_view.chunks = m_gsc.chunks.data();
        m_view.groups = m_gsc.groups.data();
        m_view.arrays = m_arrays.data();
        m_view.weights = m_gsc.weights.data();
        m_view.packed = m_gsc.packed.data();
        m_view.embedding = m_gsc.embedding.empty() ? nullptr : m_gsc.embedding.data();
        m_view.sensitivity = m_gsc.sensitivity.empty() ? nullptr : &m_gsc.sensitivity.data()->direction;
        if (const auto origin = localOrigin(m_view))
            m_view = m_local.emplace(m_view, *origin).view();
    }

    [[nodiscard]] const ModelView& view() const override { return m_view; }
    [[nodiscard]] const std::string& manifest() const override { return m_manifest; }
    [[nodiscard]] const std::vector<SourceCamera>& cameras() const override { return m_cameras; }
    [[nodiscard]] uint64_t anchorCount() const override { return m_gsc.header->anchor_count; }
    [[nodiscard]] uint64_t bytes() const override { return m_file->bytes().size(); }

    [[nodiscard]] std::vector<uint32_t> appearanceRows() const override
    {
        return {m_gsc.embedding_rows.begin(), m_gsc.embedding_rows.end()};
    }

    [[nodiscard]] int appearanceRow(int source_row) const override
    {
        const auto& rows = m_gsc.embedding_rows;
        for (size_t i = 0; i < rows.size(); ++i)
            if (source_row >= 0 && rows[i] == uint32_t(source_row))
                return int(i);
        std::string expected = "none, it has no appearance embedding";
        if (rows.size() == 1)
            expected = formatString("%u", rows[0]);
        else if (rows.size() > 1)
            expected = formatString("one of %zu rows from %u to %u", rows.size(), rows.front(), rows.back());
        throw Error(ErrorCode::Usage, m_path, formatString("appearance row %d is not in it", source_row), expected,
                    rows.empty() ? "leave the row out" : "choose a row it holds")
            .with({Setting::Appearance});
    }

private:
    std::string m_path;
    std::shared_ptr<const GscFile> m_file;
    GscView m_gsc;
    ModelView m_view{};
    std::string m_manifest;
    std::vector<ChunkArrays> m_arrays; // arrays of each chunk, by the chunk's number
    // for a model far from the origin: the copy with local positions, which m_view shows
    std::optional<LocalModel> m_local;
    std::vector<SourceCamera> m_cameras;
};

} // namespace

std::unique_ptr<Scene> Scene::open(const std::string& path, bool verify_payloads)
{
    return open(std::make_shared<const GscFile>(path, throwFirstIssue(path)), path, verify_payloads);
}

std::unique_ptr<Scene> Scene::open(std::shared_ptr<const GscFile> file, const std::string& name, bool verify_payloads)
{
    return std::make_unique<MappedScene>(std::move(file), name, verify_payloads);
}

} // namespace gsc

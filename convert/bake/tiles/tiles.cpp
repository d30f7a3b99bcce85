// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/tiles/tiles.h"

#include "convert/bake/model/file_anchors.h"
#include "convert/bake/model/gsc_checkpoint.h"
#include "convert/bake/tiles/tile_check.h"
#include "convert/bake/tiles/tile_manifest.h"
#include "convert/survey/chunk_values.h"
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include <gsc/interrupt.h>
#include <gsc/camera.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <numeric>
#include <span>

namespace gsc {

namespace {

bool isInside(const CropBox& box, const std::array<float, 3>& position)
{
    for (size_t axis = 0; axis < 3; ++axis)
        if (!(double(position[axis]) >= box.from[axis] && double(position[axis]) < box.to[axis]))
            return false;
    return true;
}

// One call of joinTiles(); the members are its state from step to step.
class Joiner {
public:
    Joiner(const TileOptions& options, const WriteProgress& progress) : m_options(options), m_progress(progress) {}

    TileReport run()
    {
        const auto start = std::chrono::steady_clock::now();
        open();
        choose();
        putInOrder();
        write();
        m_report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return std::move(m_report);
    }

private:
    // The model that the source rows of a file count in: the one it was cut from, or the file itself if it was not cut.
    static TileRecord originOf(const GscView& view)
    {
        return view.tile != nullptr ? *view.tile : TileRecord{view.header->header_checksum, view.header->anchor_count};
    }

    void open()
    {
        m_views.resize(m_options.inputs.size());
        for (size_t i = 0; i < m_views.size(); ++i) {
            const IssueSink sink = throwFirstIssue(m_options.names[i]);
            m_files.push_back(
                std::make_unique<GscFile>(m_options.inputs[i], sink, GscFile::Read::All, m_options.threads));
            openGsc(m_files[i]->bytes(), m_views[i], GscCheck::Full, sink);
            if (i > 0)
                checkSameModel(m_views[0], m_options.names[0], m_views[i], m_options.names[i]);
        }
        m_origin = originOf(m_views[0]);
        m_report.in_source_order = std::ranges::all_of(m_views, [&](const GscView& view) {
            const TileRecord origin = originOf(view);
            return origin.whole == m_origin.whole && origin.whole_anchors == m_origin.whole_anchors;
        });
    }

    // Lists the anchors that lie in the box, file by file.
    void choose()
    {
        uint64_t anchors = 0;
        for (const GscView& view : m_views)
            anchors += view.header->anchor_count;
        m_places.reserve(m_options.crop ? 0 : anchors);
        for (uint32_t f = 0; f < m_views.size(); ++f) {
            const GscView& view = m_views[f];
            const size_t first = m_places.size();
            for (uint32_t c = 0; c < view.chunks.size(); ++c) {
                throwIfInterrupted();
                const ChunkValues values(view, view.chunks[c]);
                for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i)
                    if (!m_options.crop || isInside(*m_options.crop, values.position(i)))
                        m_places.push_back({f, c, view.chunks[c].anchor_first + i});
            }
            m_report.tiles.push_back({view.header->anchor_count, m_places.size() - first});
        }
        m_report.anchors = m_places.size();
        if (m_places.empty())
            throwEmpty();
    }

    [[noreturn]] void throwEmpty() const
    {
        std::array<float, 3> least, most;
        std::copy_n(m_views[0].params->bounds_min, 3, least.begin());
        std::copy_n(m_views[0].params->bounds_max, 3, most.begin());
        for (const GscView& view : m_views)
            for (size_t axis = 0; axis < 3; ++axis) {
                least[axis] = std::min(least[axis], view.params->bounds_min[axis]);
                most[axis] = std::max(most[axis], view.params->bounds_max[axis]);
            }
        throw Error(ErrorCode::Usage, "--crop", "no anchor of " + m_options.names[0] + " lies in the box",
                    formatString("one or more of those between %.9g,%.9g,%.9g and %.9g,%.9g,%.9g", double(least[0]),
                                 double(least[1]), double(least[2]), double(most[0]), double(most[1]), double(most[2])),
                    "pass a box that meets these");
    }

    [[nodiscard]] uint32_t rowOf(const AnchorPlace& place) const
    {
        const GscView& view = m_views[place.file];
        const ChunkRecord& chunk = view.chunks[place.chunk];
        const uint32_t source = ChunkValues(view, chunk).source(place.anchor - chunk.anchor_first);
        return view.tile != nullptr ? view.tile_rows[source] : source;
    }

    // Orders the anchors: by row of the model if all files were cut from one, else by file and then by its rows. Throws
    // if two files hold one row.
    void putInOrder()
    {
        std::vector<uint32_t> rows(m_places.size());
        for (size_t i = 0; i < rows.size(); ++i)
            rows[i] = rowOf(m_places[i]);
        std::vector<uint32_t> order(m_places.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
            if (!m_report.in_source_order && m_places[a].file != m_places[b].file)
                return m_places[a].file < m_places[b].file;
            return rows[a] != rows[b] ? rows[a] < rows[b] : a < b;
        });
        std::vector<AnchorPlace> places;
        places.reserve(order.size());
        m_rows.reserve(order.size());
        for (const uint32_t i : order) {
            if (m_report.in_source_order && !m_rows.empty() && m_rows.back() == rows[i])
                throwShared(rows[i], places.back().file, m_places[i].file);
            places.push_back(m_places[i]);
            m_rows.push_back(rows[i]);
        }
        m_places = std::move(places);
    }

    [[noreturn]] void throwShared(uint32_t row, uint32_t a, uint32_t b) const
    {
        throw Error(
            ErrorCode::Difference, m_options.names[b],
            formatString("row %u of the model that it was cut from is in %s too", row, m_options.names[a].c_str()),
            "tiles that share no anchor", "cut them with boxes that do not overlap, nothing was written");
    }

    // Adds the cameras of the other files that the first file does not have.
    void addCameras(Checkpoint& checkpoint) const
    {
        const auto isSame = [](const SourceCamera& a, const SourceCamera& b) {
            return a.name == b.name && a.id == b.id && a.appearance == b.appearance && a.is_test == b.is_test &&
                   a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
                   std::ranges::equal(a.position, b.position) && std::ranges::equal(a.rotation, b.rotation);
        };
        std::multimap<std::string, SourceCamera> known;
        for (const SourceCamera& camera : checkpoint.cameras)
            known.emplace(camera.name, camera);
        for (size_t i = 1; i < m_views.size(); ++i)
            for (const CameraRecord& record : m_views[i].cameras) {
                const SourceCamera camera = sourceCamera(record, m_views[i].camera_names);
                const auto [first, last] = known.equal_range(camera.name);
                if (std::any_of(first, last, [&](const auto& other) { return isSame(other.second, camera); }))
                    continue;
                known.emplace(camera.name, camera);
                checkpoint.cameras.push_back(camera);
            }
    }

    void write()
    {
        Checkpoint checkpoint = checkpointOf(m_views[0], m_options.names[0]);
        checkpoint.anchor_count = m_places.size();
        for (const GscView& view : m_views)
            checkpoint.flags |= view.params->flags & kModelMaskedSlots;
        const auto compact = std::ranges::count_if(
            m_views, [](const GscView& view) { return (view.params->flags & kModelCompact) != 0; });
        m_some_compact = compact > 0 && size_t(compact) < m_views.size();
        if (m_some_compact)
            checkpoint.flags &= ~uint32_t(kModelCompact);
        addCameras(checkpoint);

        WriteOptions write = writeOptionsOf(m_views[0]);
        write.output = m_options.output;
        write.overwrite = m_options.overwrite;
        write.threads = m_options.threads;
        TileFacts facts;
        for (const GscView& view : m_views)
            facts.manifests.push_back(view.manifest);
        facts.one_model = m_report.in_source_order;
        facts.source_hash = sourceHash();
        facts.box = m_options.crop;
        if (facts.one_model && m_places.size() < m_origin.whole_anchors)
            facts.tile = m_origin;
        write.source.emplace(KnownSource{facts.source_hash, tileFactsText(facts),
                                         facts.tile ? tileSection() : std::vector<std::byte>()});
        write.verify = [&](const std::string& path) { checkWhole(path); };
        FileAnchors source(m_views, m_places);
        const WriteReport made = writeGscFrom(checkpoint, source, write, m_progress);
        m_report.bytes = made.output_bytes;
        m_report.warnings = made.warnings;
        if (m_some_compact)
            m_report.warnings.push_back("some tiles are compact and some are not: the whole is not");
        m_report.whole_anchors = facts.one_model ? m_origin.whole_anchors : 0;
    }

    [[nodiscard]] uint64_t sourceHash() const
    {
        if (m_report.in_source_order)
            return m_views[0].header->source_hash;
        std::vector<uint64_t> hashes;
        for (const GscView& view : m_views)
            hashes.push_back(view.header->source_hash);
        return checksum64(std::as_bytes(std::span(hashes)));
    }

    [[nodiscard]] std::vector<std::byte> tileSection() const
    {
        std::vector<std::byte> bytes(sizeof(m_origin) + m_rows.size() * sizeof(uint32_t));
        std::memcpy(bytes.data(), &m_origin, sizeof(m_origin));
        std::memcpy(bytes.data() + sizeof(m_origin), m_rows.data(), m_rows.size() * sizeof(uint32_t));
        return bytes;
    }

    // Notes whether the output is the whole model again: the checksum in its header stands for all bytes.
    void checkWhole(const std::string& path)
    {
        const IssueSink sink = throwFirstIssue(m_options.output);
        const GscFile file(path, sink, GscFile::Read::Summary);
        GscView view;
        openGscSummary(file.bytes(), view, sink);
        m_report.is_whole = m_report.in_source_order && view.header->header_checksum == m_origin.whole;
    }

    const TileOptions& m_options;
    const WriteProgress& m_progress;
    std::vector<std::unique_ptr<GscFile>> m_files;
    std::vector<GscView> m_views;
    TileRecord m_origin{};
    std::vector<AnchorPlace> m_places;
    std::vector<uint32_t> m_rows; // per written anchor: its row in the model that all files were cut from
    TileReport m_report;
    bool m_some_compact = false;
};

} // namespace

TileReport joinTiles(const TileOptions& options, const WriteProgress& progress)
{
    return Joiner(options, progress).run();
}

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
#include "player/shard/frame_shard.h"

#include "runtime/records/report_parts.h"
#include "runtime/records/reuse_names.h"
#include "player/frames/content_hash.h"
#include <gsc/frame_stats.h>

#include <filesystem>

namespace gsc {

namespace {

// Hash of everything that changes the images, or a number of a row other than times and memory.
uint64_t setHash(const PlayOptions& options, const std::vector<Shot>& shots, const std::string& backend, Tier tier)
{
    OrderedJson frames = OrderedJson::array();
    for (const Shot& shot : shots)
        frames.push_back({shot.index, shot.camera.name, shot.camera.width, shot.camera.height});
    const std::string extension = std::filesystem::path(options.output.out).extension().string();
    const OrderedJson said = {
        {"tool", toJson(thisTool())},
        {"backend", backend},
        {"tier", tierName(tier)},
        {"eyes", options.view.eyes},
        {"stereo", stereoName(options.frame.stereo)},
        {"lod_bias", options.frame.lod_bias},
        {"lod_fade", options.frame.lod_fade},
        {"near", options.frame.near_z},
        {"background", options.frame.background ? OrderedJson(*options.frame.background) : OrderedJson()},
        {"vram_budget", options.devices.vram_budget},
        {"images", extension},
        {"depth", options.output.depth == PixelDepth::Sixteen ? 16 : 8},
        {"frames", std::move(frames)}};
    const std::string text = jsonText(said, -1);
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(text)));
    addPoses(shots, uint32_t(options.view.eyes), sum);
    return sum.digest();
}

} // namespace

FrameShard::FrameShard(const PlayOptions& options) : m_options(options)
{
    if (options.shard.isGiven())
        m_rows.emplace(options.output.stats, kFrameRow, options.shard);
}

bool FrameShard::isDone(size_t frame, const std::vector<std::string>& paths) const
{
    if (!m_rows || m_rows->find(frame) == nullptr)
        return false;
    const size_t eyes = paths.empty() ? 0 : size_t(m_options.view.eyes);
    for (size_t eye = 0; eye < eyes; ++eye) {
        std::error_code code;
        const uint64_t bytes = std::filesystem::file_size(paths[frame * eyes + eye], code);
        if (code || bytes == 0)
            return false;
    }
    return true;
}

void FrameShard::plan(size_t frames, const std::vector<std::string>& paths, Reporter& log)
{
    for (size_t i = 0; i < frames; ++i) {
        if (!takesTask(m_options.shard, i))
            continue;
        ++m_own;
        if (isDone(i, paths))
            continue;
        if (m_rows && !m_rows->isNew() && !m_cut && m_rows->find(i) == nullptr)
            m_cut = i; // the first without a row, because frames are drawn in order
        m_frames.push_back(i);
    }
    if (m_rows && !m_rows->cutOff().empty())
        log.warning(m_rows->cutOff());
}

bool FrameShard::mayReplace(size_t frame) const
{
    const bool is_ours = m_rows && m_rows->find(frame) != nullptr; // drawn before, but an image is missing now
    return m_options.output.overwrite || m_cut == frame || is_ours;
}

void FrameShard::check(const std::vector<Shot>& shots, const std::string& backend, Tier tier)
{
    if (m_rows)
        m_rows->check(shardFacts(m_options.shard, shots.size(), fileHash(m_options.model.file),
                                 setHash(m_options, shots, backend, tier)));
}

void FrameShard::begin()
{
    if (m_rows)
        m_rows->begin();
}

void FrameShard::add(size_t frame, const std::string& line)
{
    if (m_rows->find(frame) == nullptr)
        m_rows->add(frame, line);
}

} // namespace gsc

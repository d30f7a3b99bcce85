// SPDX-License-Identifier: Apache-2.0
#include "player/play/play_outputs.h"

#include <gsc/error.h>
#include "player/output/out_pattern.h"
#include "runtime/image/image_io.h"

#include <filesystem>
#include <span>
#include <utility>

namespace gsc {

namespace {

std::vector<std::string> imagePaths(const std::vector<Shot>& shots, const std::string& pattern, int eyes)
{
    std::vector<OutputFrame> named;
    for (const Shot& shot : shots)
        named.push_back({shot.camera.name, shot.index});
    return outputPaths(pattern, named, eyes);
}

void makeFolderOf(const std::string& file)
{
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(file).parent_path();
    std::error_code code;
    if (!folder.empty() && !fs::is_directory(folder, code) && !fs::create_directories(folder, code) && code)
        throw Error(ErrorCode::Io, folder.string(), "cannot be created (" + code.message() + ")",
                    "a folder that may be written", "choose another place or change its rights");
}

void warnOfOddSides(const std::string& path, uint32_t width, uint32_t height, Reporter& log)
{
    if (width % 2 == 0 && height % 2 == 0)
        return;
    log.warning(formatString("%s: pictures of %u x %u pixels, of which browsers play even sides only; the video has "
                             "%u x %u, because its last %s repeated",
                             path.c_str(), width, height, width + width % 2, height + height % 2,
                             height % 2 == 0  ? "column is"
                             : width % 2 == 0 ? "row is"
                                              : "column and row are"));
}

} // namespace

PlayOutputs::PlayOutputs(const PlayOptions& options, const std::vector<Shot>& shots, FrameShard& shard, Reporter& log)
    : m_options(options), m_shots(shots), m_shard(shard), m_eyes(size_t(options.view.eyes)),
      m_streams(isStandardOutput(options.output.out))
{
    if (!options.output.out.empty() && !m_streams)
        m_paths = imagePaths(shots, options.output.out, options.view.eyes);
    shard.plan(shots.size(), m_paths, log);
    m_files = checkPaths(log);
    if (m_streams || !options.output.video.empty())
        checkOneSize();
    if (!m_paths.empty())
        loadImageWriter(m_paths.front());
}

void PlayOutputs::open(double fps, Reporter& log)
{
    for (const NamedPath& file : m_files)
        makeFolderOf(file.path);
    m_shard.begin();
    const OutputChoice& to = m_options.output;
    if (!to.stats.empty() && !m_options.shard.isGiven())
        m_stats.emplace(to.stats, OutputKind::Text, to.overwrite);
    const Camera& first = m_shots.front().camera;
    if (m_streams)
        m_stream.emplace(to.stream, first.width, first.height, uint32_t(m_eyes), fps, standardOutputSink());
    if (to.video.empty())
        return;
    m_video.emplace(to.video, first.width, first.height, uint32_t(m_eyes), fps, to.overwrite);
    warnOfOddSides(to.video, first.width * uint32_t(m_eyes), first.height, log);
}

std::vector<NamedPath> PlayOutputs::checkPaths(Reporter& log) const
{
    const OutputChoice& to = m_options.output;
    std::vector<NamedPath> outputs, inputs = {{m_options.model.file, "the model"}};
    for (const std::string& path : m_paths)
        outputs.push_back({path, "an image of --out"});
    if (!to.stats.empty())
        outputs.push_back({to.stats, "--stats"});
    if (!to.video.empty())
        outputs.push_back({to.video, to.video_option});
    if (m_options.cameras.isFile())
        inputs.push_back({m_options.cameras.file, "the camera file"});
    checkStandardOutput(to.stats, "--stats", log.json());
    checkStandardOutput(to.out, "--out", log.json());
    checkOutputsDiffer(outputs, inputs);
    for (const size_t shot : m_shard.frames())
        for (size_t eye = 0; eye < m_eyes && !m_paths.empty(); ++eye)
            checkOutput(m_paths[shot * m_eyes + eye], OutputKind::Binary, m_shard.mayReplace(shot),
                        OutputFolder::IsMade);
    if (!to.stats.empty())
        checkOutput(to.stats, OutputKind::Text, to.overwrite || m_options.shard.isGiven(), OutputFolder::IsMade);
    if (!to.video.empty()) {
        checkVideoProgram(to.video_option);
        checkOutput(to.video, OutputKind::Binary, to.overwrite, OutputFolder::IsMade);
    }
    return outputs;
}

void PlayOutputs::checkOneSize() const
{
    const Camera& first = m_shots.front().camera;
    for (const Shot& shot : m_shots)
        if (shot.camera.width != first.width || shot.camera.height != first.height)
            throw Error(ErrorCode::Usage, m_options.output.video.empty() ? "--out -" : m_options.output.video_option,
                        formatString("camera %s has %u x %u pixels", shot.camera.name.c_str(), shot.camera.width,
                                     shot.camera.height),
                        formatString("%u x %u as all before it", first.width, first.height),
                        "choose one --size for all, or write files");
}

std::vector<std::string> PlayOutputs::add(size_t shot, LoopFrame& drawn, const std::string& stats)
{
    std::vector<std::string> written;
    Image images[kMaxEyes];
    for (size_t eye = 0; eye < m_eyes; ++eye) {
        images[eye] = {drawn.shot->camera.width, drawn.shot->camera.height, std::move(drawn.images[eye])};
        if (m_paths.empty())
            continue;
        written.push_back(m_paths[shot * m_eyes + eye]);
        writeImage(written.back(), images[eye], m_options.output.depth, m_shard.mayReplace(shot));
    }
    const std::span<const Image> eyes(images, m_eyes);
    if (m_stream)
        m_stream->add(eyes);
    if (m_video)
        m_video->add(eyes);
    for (size_t eye = 0; eye < m_eyes; ++eye)
        // returns the pixels' memory, so that the next frame is drawn into it
        drawn.images[eye] = std::move(images[eye].pixels);
    if (m_stats)
        m_stats->write(stats + "\n");
    if (m_options.shard.isGiven())
        m_shard.add(shot, stats);
    return written;
}

void PlayOutputs::commit()
{
    if (m_video)
        m_video->commit();
    if (m_stats)
        m_stats->commit();
}

} // namespace gsc

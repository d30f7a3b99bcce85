// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/reduce.h"

#include "convert/bake/bake.h"
#include "convert/bake/mlp_pack.h"
#include "convert/reduce/file_anchors.h"
#include "convert/reduce/gsc_checkpoint.h"
#include "convert/reduce/reduce_manifest.h"
#include "convert/reduce/step_search.h"
#include "format/error.h"
#include "format/gsc_file.h"
#include "format/interrupt.h"
#include "kernels/threads/parallel.h"
#include "player/cameras/scene_cameras.h"
#include "runtime/scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

namespace gsc {

namespace {

constexpr size_t kFewestCameras = 4;
// Where the verdict is short, the search aims higher by a share of that, and no more often than this: few cameras are no
// good sample of each other.
constexpr int kMostAgain = 4;
constexpr double kAgainShare = 0.6, kAgainMargin = 0.1; // dB

// One bake; the members are its state from stage to stage.
class Reducer {
public:
    Reducer(const ReduceOptions& options, const ReduceProgress& progress)
        : m_options(options), m_progress(progress), m_workers(options.threads),
          m_file(options.input, throwFirstIssue(options.name), GscFile::Read::All, options.threads)
    {
        openGsc(m_file.bytes(), m_view, GscCheck::Full, throwFirstIssue(options.name));
        m_scene = Scene::open(options.input);
    }

    ReduceReport run()
    {
        const auto start = Clock::now();
        m_report.anchors = m_view.header->anchor_count;
        m_report.slots = m_report.anchors * m_view.params->n_offsets;
        stage("poses", [&] { choosePoses(); });
        ImportanceMeter meter(m_scene->view(), m_options.threads);
        PictureProbe probe(m_scene, m_options.threads, [this] { tell(); });
        stage("weights", [&] { weigh(meter, probe); });
        m_report.anchors_unseen = uint64_t(std::ranges::count(meter.result().seen, 0u));
        stage("references", [&] {
            probe.addPoses(m_poses.search);
            probe.addPoses(m_poses.verdict);
        });
        Checkpoint checkpoint = checkpointOf(m_view, m_options.name);
        roundToHalves(checkpoint.mlps);
        const std::vector<std::byte> weights = canonicalMlps(checkpoint.mlps);
        const std::vector<std::byte> packed = packMlps(checkpoint.mlps, checkpoint.feat_dim, checkpoint.appearance_dim);
        ReducedModel model(m_scene->view(), meter.result(), m_workers, weights, packed);
        // another order draws ties otherwise: 78 dB in the worst view of a trained model
        const bool by_source = !(m_options.levers & kLeverOrder) || !m_options.target_psnr;
        const std::vector<uint32_t> order = anchorOrder(m_view, by_source);
        if (!by_source)
            model.setOrder(numbersOf(order));
        m_report.plan.levers = m_options.levers;
        stage("search", [&] { search(model, probe); });
        stage("verdict", [&] { judge(model, probe); });
        for (int again = 0; lack() > 0; ++again) {
            if (again == kMostAgain)
                refuse(m_report.verdict, "verdict", "though poses of the search keep more");
            m_margin += kAgainShare * lack() + kAgainMargin;
            m_pictures += 3 * m_poses.search.size() + m_poses.verdict.size();
            stage("search", [&] { search(model, probe); });
            stage("verdict", [&] { judge(model, probe); });
        }
        m_report.anchors_left_out = model.leftOut();
        m_report.slots_masked = model.masked();
        stage("write", [&] { write(std::move(checkpoint), model, order); });
        m_report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        return std::move(m_report);
    }

private:
    using Clock = std::chrono::steady_clock;

    template <typename Work>
    void stage(const char* name, Work&& work)
    {
        throwIfInterrupted();
        const auto start = Clock::now();
        work();
        m_report.stages.push_back({name, std::chrono::duration<double>(Clock::now() - start).count()});
    }

    void tell()
    {
        ++m_drawn;
        if (m_progress)
            m_progress("bake", std::min(m_drawn, m_pictures), m_pictures);
    }

    static std::vector<uint32_t> numbersOf(const std::vector<uint32_t>& order)
    {
        std::vector<uint32_t> numbers(order.size());
        for (uint32_t i = 0; i < order.size(); ++i)
            numbers[order[i]] = i;
        return numbers;
    }

    void choosePoses()
    {
        std::vector<Camera> cameras;
        for (const std::string& path : m_options.cameras)
            std::ranges::move(sceneCameras(*m_scene, path, nullptr), std::back_inserter(cameras));
        if (m_options.cameras.empty())
            cameras = sceneCameras(*m_scene, "stored", nullptr);
        if (cameras.size() < kFewestCameras)
            throw Error(ErrorCode::Usage,
                        formatString("%s: %zu cameras, expected %zu or more to find weights, steps and a verdict from; "
                                     "pass --cameras FILE",
                                     m_options.name.c_str(), cameras.size(), kFewestCameras));
        m_poses = splitPoses(std::move(cameras), m_options.limits);
        m_report.weight_poses = m_poses.weights.size();
        m_pictures = m_poses.weights.size() + m_poses.search.size() + 2 * m_poses.verdict.size() +
                     (m_options.target_psnr ? searchPictures(m_poses.search.size()) : m_poses.search.size());
    }

    void weigh(ImportanceMeter& meter, const PictureProbe& probe)
    {
        for (const Camera& camera : m_poses.weights) {
            throwIfInterrupted();
            const EyeParams eye = probe.eyeOf(camera);
            const FrameOptions options = probe.optionsOf(camera);
            meter.add(eye, options);
            meter.lookFrom(eye.center, options.appearance);
            m_weight_pixels += uint64_t(camera.width) * camera.height;
            tell();
        }
    }

    void search(ReducedModel& model, PictureProbe& probe)
    {
        SearchTask task{model, probe, m_poses.search.size(), m_weight_pixels, m_options.levers};
        if (!m_options.target_psnr) {
            m_report.plan.levers = m_options.levers & (kLeverSlots | kLeverAnchors);
            model.apply(m_report.plan);
            m_report.search = probe.score(model.view(), 0, m_poses.search.size());
            m_report.levers = m_report.plan.levers;
            return;
        }
        m_report.target = *m_options.target_psnr;
        m_report.min_view = m_options.min_view_psnr.value_or(m_report.target - 4);
        task.target = m_report.target;
        task.min_view = m_report.min_view;
        task.margin = m_margin;
        const ReducePlan before = m_report.plan;
        if (m_report.probes > 0)
            task.from = &before;
        const SearchResult found = searchSteps(task);
        m_report.plan = found.plan;
        m_report.levers = found.plan.levers;
        m_report.search = found.score;
        m_report.probes += found.probes;
        if (!found.kept)
            refuse(found.score, "search", "the steps could be no finer");
    }

    void judge(const ReducedModel& model, PictureProbe& probe)
    {
        m_report.verdict = probe.score(model.view(), m_poses.search.size(), m_poses.verdict.size());
    }

    // dB that the verdict is short of what was asked for.
    [[nodiscard]] double lack() const
    {
        return m_options.target_psnr ? std::max(m_report.target - m_report.verdict.psnr,
                                                m_report.min_view - m_report.verdict.worstPose().psnr)
                                     : 0;
    }

    [[noreturn]] void refuse(const SetScore& score, const char* set, const char* why) const
    {
        const PoseScore& worst = score.worstPose();
        throw Error(ErrorCode::Difference,
                    formatString("%s: the poses of the %s have %.2f dB together and %.2f dB at %s, expected %.2f and "
                                 "%.2f (%s); nothing was written, pass another --target-psnr or --min-view-psnr, more "
                                 "--cameras or fewer --levers",
                                 m_options.name.c_str(), set, score.psnr, worst.psnr, worst.name.c_str(),
                                 m_report.target, m_report.min_view, why));
    }

    void write(Checkpoint checkpoint, const ReducedModel& model, const std::vector<uint32_t>& order)
    {
        if (!(m_report.levers & kLeverNetworks))
            checkpoint = checkpointOf(m_view, m_options.name);
        if (model.masked() > 0)
            checkpoint.flags |= kModelMaskedSlots;
        const std::vector<AnchorPlace> places = keptPlaces(m_view, model, order);
        const std::vector<GscView> files{m_view};
        FileAnchors source(files, places, &model);
        checkpoint.anchor_count = places.size();
        if (checkpoint.anchor_count == 0)
            throw Error(ErrorCode::Difference, m_options.name + ": no anchor would be left, expected one; no pose sees "
                                                                "any, pass other --cameras");
        m_report.before = {m_file.bytes().size(), archiveSize(m_file.bytes(), m_view, m_options.threads)};
        BakeOptions bake;
        bake.output = m_options.output;
        bake.overwrite = m_options.overwrite;
        bake.threads = m_options.threads;
        bake.appearance = appearanceOf(m_view);
        bake.sensitivity = SensitivityMode::None;
        bake.source.emplace(BakedSource{
            m_view.header->source_hash, reducedFacts(m_view.manifest, reductionText(m_report, m_options)), {}});
        bake.verify = [&](const std::string& path) { measureFile(path); };
        (void)bakeFrom(checkpoint, source, bake, [](const char*, uint64_t, uint64_t) {});
    }

    // The file before it has its name.
    void measureFile(const std::string& path)
    {
        const IssueSink sink = throwFirstIssue(m_options.output);
        const GscFile file(path, sink);
        GscView view;
        openGsc(file.bytes(), view, GscCheck::Full, sink);
        m_report.after = {file.bytes().size(), archiveSize(file.bytes(), view, m_options.threads)};
        if (m_options.max_bytes > 0 && m_report.after.archive.file > m_options.max_bytes)
            throw Error(ErrorCode::Difference,
                        formatString("%s: its archive would have %llu bytes, expected at most %llu of --max-bytes; "
                                     "nothing was written, pass a lower --target-psnr or more bytes",
                                     m_options.output.c_str(), (unsigned long long)m_report.after.archive.file,
                                     (unsigned long long)m_options.max_bytes));
    }

    const ReduceOptions& m_options;
    const ReduceProgress& m_progress;
    Workers m_workers;
    GscFile m_file;
    GscView m_view;
    std::shared_ptr<const Scene> m_scene;
    PoseSets m_poses;
    uint64_t m_weight_pixels = 0;
    double m_margin = kSearchMargin;
    uint64_t m_drawn = 0, m_pictures = 0;
    ReduceReport m_report;
};

} // namespace

ReduceReport reduce(const ReduceOptions& options, const ReduceProgress& progress)
{
    return Reducer(options, progress).run();
}

std::vector<int64_t> leverShares(const ReduceReport& report)
{
    std::vector<int64_t> shares(kLevers, 0);
    const StoredBytes &before = report.before.archive, &after = report.after.archive;
    const double stay = 1 - double(report.anchors_left_out) / double(report.anchors);
    // what is left out takes its part of every array with it, at what that took of the source
    const double offsets = stay * double(before.offsets);
    const double kept_slots = stay * double(report.slots);
    const double masked = kept_slots > 0 ? offsets * double(report.slots_masked) / kept_slots : 0;
    const auto set = [&](Lever lever, double bytes) {
        shares[size_t(std::countr_zero(uint32_t(lever)))] = int64_t(std::llround(bytes));
    };
    set(kLeverAnchors, (1 - stay) * double(before.anchors()));
    set(kLeverSlots, masked);
    set(kLeverOffsets, offsets - masked - double(after.offsets));
    set(kLeverFeatures, stay * double(before.features) - double(after.features));
    set(kLeverScales, stay * double(before.scales) - double(after.scales));
    set(kLeverOrder, stay * double(before.positions) - double(after.positions));
    set(kLeverNetworks, double(before.networks) - double(after.networks));
    return shares;
}

} // namespace gsc

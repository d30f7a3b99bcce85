// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/bake.h"

#include "convert/bake/bake_facts.h"
#include "convert/bake/bake_manifest.h"
#include "convert/bake/bake_meter.h"
#include "convert/bake/model/file_anchors.h"
#include "convert/bake/model/gsc_checkpoint.h"
#include "convert/bake/pictures/pose_sets.h"
#include "convert/bake/state/bake_state.h"
#include "convert/bake/step_search.h"
#include "convert/write/mlp_pack.h"
#include "convert/write/write_gsc.h"
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include <gsc/interrupt.h>
#include "kernels/decode/fast/fragments.h"
#include "kernels/threads/parallel.h"
#include "runtime/cameras/scene_cameras.h"
#include <gsc/renderer.h>
#include <gsc/scene.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace gsc {

namespace {

constexpr size_t kFewestCameras = 4;
// If the pictures of the verdict miss the target, the search is repeated with a target that is higher by kAgainShare of
// the gap, at most this often. The two sets of poses can differ much where cameras are few.
constexpr int kMostAgain = 4;
// share of the gap by which the target is raised, and dB on top of that
constexpr double kAgainShare = 0.6, kAgainMargin = 0.1;

static_assert(PoseLimits{}.weights <= kMostImportancePoses);

// Bakes one model to one target or to several. Work that does not depend on the target is done once, in the
// constructor. `options` and `progress` must outlive this. Throws as bake().
class Baker {
public:
    // `curve`: targets of all the calls of bakeTo() to come; empty if there is only that of the options, or none.
    Baker(const BakeOptions& options, const BakeProgress& progress, std::span<const double> curve = {})
        : m_options(options), m_progress(progress), m_workers(options.threads), m_source(options)
    {
        const auto start = Clock::now();
        // a file in the compact form stays in it
        if (m_source.view.params->flags & kModelCompact)
            m_options.levers |= kLeverCompact;
        const ModelParams& params = *m_source.view.params;
        if ((m_options.levers & kLeverCompact) &&
            (params.feat_dim != kFastFeatures || params.n_offsets > 4 * kItemsPerLane))
            m_report.warnings.push_back(formatString(
                "--compact: saves no memory of a model of %u features and %u Gaussians an anchor, expected "
                "32 and at most 12; leave it out",
                params.feat_dim, params.n_offsets));
        m_report.anchors = m_source.view.header->anchor_count;
        m_report.slots = m_report.anchors * params.n_offsets;
        stage("poses", [&] { choosePoses(); });
        openDevice(curve);
        stage("sizes", [&] { m_report.before = m_meter->sizes(); });
        m_source.letGo();
        stage("weights", [&] { m_importance.emplace(m_meter->weigh(m_report.before)); });
        m_report.anchors_unseen = uint64_t(std::ranges::count(m_importance->seen, 0u));
        stage("references", [&] { m_meter->drawWhole(); });
        std::vector<Mlp> halves = checkpointOf(m_source.view, m_options.name).mlps;
        roundToHalves(halves);
        m_weights = canonicalMlps(halves);
        m_packed = packMlps(halves, params.feat_dim, params.appearance_dim);
        // Gaussians of equal depth are drawn in the order of the anchors; a new order alone gave 78 dB in the worst
        // view of a trained model, so without a target the order stays
        const bool by_source = !(m_options.levers & kLeverOrder) || !m_options.target_psnr;
        m_order = anchorOrder(m_source.view, by_source);
        m_model.emplace(m_source.scene->view(), *m_importance, m_workers, m_weights, m_packed, m_source.whenRead());
        if (!by_source)
            m_model->setOrder(numbersOf(m_order));
        m_report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        m_prepared = m_report;
    }

    Baker(const Baker&) = delete;
    Baker& operator=(const Baker&) = delete;

    // Writes one baked file. `output` and `target` replace those of the options; `target` must be set if and only if
    // the options have one. `last`: no other call follows, so memory is freed as soon as possible.
    BakeReport bakeTo(const std::string& output, std::optional<double> target, std::optional<double> min_view,
                      bool last = false)
    {
        const auto start = Clock::now();
        m_report = m_prepared;
        m_output = output;
        m_target = target;
        m_report.target = target.value_or(0);
        m_report.min_view = target ? min_view.value_or(*target - 4) : 0;
        m_report.plan.levers = m_options.levers;
        m_margin = kSearchMargin;
        stage("search", [&] { search(); });
        stage("verdict", [&] { judge(); });
        for (int again = 0; lack() > 0; ++again) {
            if (again == kMostAgain)
                refuse(m_report.verdict, "verdict", "though poses of the search keep more");
            m_margin += kAgainShare * lack() + kAgainMargin;
            m_meter->expect(3 * m_poses.search.size() + m_poses.verdict.size());
            stage("search", [&] { search(); });
            stage("verdict", [&] { judge(); });
        }
        m_model->apply(m_report.plan);
        m_report.anchors_left_out = m_model->leftOut();
        m_report.slots_masked = m_model->masked();
        m_report.pictures_drawn = m_meter->drawn();
        m_report.pictures_kept = m_meter->kept();
        if (last) {
            m_meter.reset();
            m_importance.reset();
        }
        stage("write", [&] { write(last); });
        m_report.seconds += std::chrono::duration<double>(Clock::now() - start).count();
        return std::move(m_report);
    }

    // Scores the pictures of a file, baked or not, from the poses of the verdict.
    [[nodiscard]] FileScore measure(const std::string& path) { return m_meter->measure(path); }

    // the part of the report that is equal for all targets
    [[nodiscard]] const BakeReport& prepared() const { return m_prepared; }

private:
    using Clock = std::chrono::steady_clock;

    template <typename Work>
    void stage(const char* name, Work&& work)
    {
        throwIfInterrupted();
        const auto start = Clock::now();
        work();
#if defined(__GLIBC__)
        // glibc keeps freed memory for the thread that used it, but the next stage runs on other threads
        (void)malloc_trim(0);
#endif
        m_report.stages.push_back({name, std::chrono::duration<double>(Clock::now() - start).count()});
    }

    static std::vector<uint32_t> numbersOf(const std::vector<uint32_t>& order)
    {
        std::vector<uint32_t> numbers(order.size());
        for (uint32_t i = 0; i < order.size(); ++i)
            numbers[order[i]] = i;
        return numbers;
    }

    // Opens a renderer with the whole model loaded, and the file of a stopped bake, which fits only if the device is
    // the same.
    void openDevice(std::span<const double> curve)
    {
        std::vector<std::string> passed_over;
        std::unique_ptr<Renderer> renderer =
            makeLoadedRenderer(m_options.device, {m_options.threads}, m_source.scene, passed_over);
        m_report.device = deviceText(renderer->id());
        m_report.warnings.insert(m_report.warnings.end(), passed_over.begin(), passed_over.end());
        std::optional<BakeState> before;
        if (!m_options.resume.empty())
            before.emplace(m_options.resume, bakeFacts(m_options, curve, m_source.view, m_poses, *renderer),
                           std::max(m_poses.search.size(), m_poses.verdict.size()), m_options.resume_seconds);
        m_meter.emplace(m_source, m_poses, std::move(renderer), std::move(before), m_options.threads, m_progress);
        const size_t search = m_poses.search.size(), verdict = m_poses.verdict.size();
        m_meter->expect(m_poses.weights.size() + search + verdict +
                        std::max<size_t>(curve.size(), 1) *
                            (verdict + (m_options.target_psnr ? searchPictures(search) : search)));
    }

    void choosePoses()
    {
        std::vector<Camera> cameras;
        for (const std::string& path : m_options.cameras)
            std::ranges::move(
                sceneCameras(*m_source.scene, path,
                             {m_options.ignore_distortion, m_options.cameras_transform, &m_report.warnings}),
                std::back_inserter(cameras));
        if (m_options.cameras.empty())
            cameras = sceneCameras(*m_source.scene, "stored", {});
        // two equal poses could end up in the sets for weights and for verdict, which must share none
        leaveOutRepeats(cameras);
        if (cameras.size() < kFewestCameras)
            throw Error(ErrorCode::Usage, m_options.name, formatString("%zu different cameras", cameras.size()),
                        formatString("%zu or more to find weights, steps and a verdict from", kFewestCameras),
                        "pass --cameras FILE");
        m_poses = splitPoses(std::move(cameras), m_options.limits);
        m_report.weight_poses = m_poses.weights.size();
    }

    void search()
    {
        if (!m_target) {
            m_report.plan.levers = m_options.levers & (kLeverSlots | kLeverAnchors | kLeverCompact);
            m_report.search = m_meter->score(*m_model, m_report.plan, 0, m_poses.search.size());
            m_report.levers = m_report.plan.levers;
            return;
        }
        const PlanScore score = [this](const BakePlan& plan, size_t first, size_t count) {
            return m_meter->score(*m_model, plan, first, count);
        };
        SearchTask task{*m_source.scene->view().params, m_report.anchors,        score,
                        m_poses.search.size(),          m_meter->weightPixels(), m_options.levers};
        task.target = m_report.target;
        task.min_view = m_report.min_view;
        task.margin = m_margin;
        const BakePlan before = m_report.plan;
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

    void judge()
    {
        m_report.verdict = m_meter->score(*m_model, m_report.plan, m_poses.search.size(), m_poses.verdict.size());
    }

    // Decibels that the verdict lacks, pooled to the target or in its worst view to the least PSNR of a view, whichever
    // is more; 0 or less if it reaches both.
    [[nodiscard]] double lack() const
    {
        return m_target ? std::max(m_report.target - m_report.verdict.psnr,
                                   m_report.min_view - m_report.verdict.worstPose().psnr)
                        : 0;
    }

    [[noreturn]] void refuse(const SetScore& score, const char* set, const char* why) const
    {
        const PoseScore& worst = score.worstPose();
        throw Error(ErrorCode::Difference, m_options.name,
                    formatString("the pictures of the %s have PSNR %.2f dB pooled and %.2f dB at %s", set, score.psnr,
                                 worst.psnr, worst.name.c_str()),
                    formatString("%.2f and %.2f (%s)", m_report.target, m_report.min_view, why),
                    formatString("nothing was written, pass another --target-psnr or --min-view-psnr, more --cameras "
                                 "or fewer --levers%s",
                                 m_options.levers & kLeverCompact ? ", or leave --compact out" : ""));
    }

    void write(bool last)
    {
        Checkpoint checkpoint = checkpointOf(m_source.view, m_options.name);
        if (m_report.levers & kLeverNetworks)
            roundToHalves(checkpoint.mlps);
        if (m_model->masked() > 0)
            checkpoint.flags |= kModelMaskedSlots;
        if (m_report.levers & kLeverCompact)
            checkpoint.flags |= kModelCompact;
        const std::vector<AnchorPlace> places = keptPlaces(m_source.view, *m_model, m_order);
        const std::vector<GscView> files{m_source.view};
        FileAnchors source(files, places, &*m_model);
        checkpoint.anchor_count = places.size();
        if (checkpoint.anchor_count == 0)
            throw Error(ErrorCode::Difference, m_options.name, "no anchor would be left", "one",
                        "no pose sees any, pass other --cameras");
        WriteOptions write;
        write.output = m_output;
        write.overwrite = m_options.overwrite;
        write.threads = m_options.threads;
        // a file with a single row of the appearance embedding was converted with the option --appearance; with several
        // rows the option stays unset, whatever the manifest says
        if (m_source.view.embedding_rows.size() == 1)
            write.appearance = int(m_source.view.embedding_rows[0]);
        write.sensitivity = SensitivityMode::None;
        write.source.emplace(KnownSource{m_source.view.header->source_hash,
                                         reducedFacts(m_source.view.manifest, reductionText(m_report, m_target)),
                                         {}});
        write.verify = [&](const std::string& path) {
            if (last) // no target follows, and all anchors have been read, so the model can be freed
                m_model.reset();
            measureFile(path);
        };
        (void)writeGscFrom(checkpoint, source, write, [](const char*, uint64_t, uint64_t) {});
    }

    // Measures the sizes of the written file before it is renamed to the output. Throws if its archive is larger than
    // --max-bytes.
    void measureFile(const std::string& path)
    {
        const std::string& name = m_options.output_name.empty() ? m_output : m_options.output_name;
        const IssueSink sink = throwFirstIssue(name);
        const GscFile file(path, sink);
        GscView view;
        openGsc(file.bytes(), view, GscCheck::Full, sink);
        file.letGo(file.bytes());
        m_report.after = {file.bytes().size(), archiveSize(file, view, m_options.threads)};
        if (m_options.max_bytes > 0 && m_report.after.archive.file > m_options.max_bytes)
            throw Error(
                ErrorCode::Difference, name,
                formatString("its archive would have %llu bytes", (unsigned long long)m_report.after.archive.file),
                formatString("at most %llu of --max-bytes", (unsigned long long)m_options.max_bytes),
                "nothing was written, pass a lower --target-psnr or more bytes");
    }

    BakeOptions m_options;
    const BakeProgress& m_progress;
    Workers m_workers;
    SourceModel m_source;
    PoseSets m_poses;
    std::optional<Importance> m_importance;
    std::vector<std::byte> m_weights, m_packed; // networks as sections MLPW and MLPP, rounded to halves
    std::optional<ReducedModel> m_model;
    std::optional<BakeMeter> m_meter; // destroyed before m_model, which its renderer may have loaded
    std::vector<uint32_t> m_order;    // order in which the anchors are written
    BakeReport m_prepared;            // the part of the report that is equal for all targets
    // state of the bakeTo() that is running
    std::string m_output;
    std::optional<double> m_target;
    double m_margin = kSearchMargin;
    BakeReport m_report;
};

} // namespace

BakeReport bake(const BakeOptions& options, const BakeProgress& progress)
{
    BakeReport report =
        Baker(options, progress).bakeTo(options.output, options.target_psnr, options.min_view_psnr, true);
    removeBakeState(options.resume, report.warnings);
    return report;
}

Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets, const std::string& scratch,
                const BakeProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    BakeOptions same = options;
    // any target tells the constructor that there is one; each bakeTo() gets its own
    same.target_psnr = targets.front();
    same.overwrite = true;
    Baker baker(same, progress, targets);
    Curve curve;
    curve.anchors = baker.prepared().anchors;
    curve.device = baker.prepared().device;
    curve.warnings = baker.prepared().warnings;
    curve.points.push_back({std::nullopt, curve.anchors, baker.prepared().before, baker.measure(options.input)});
    for (const double target : targets) {
        try {
            const BakeReport report = baker.bakeTo(scratch, target, options.min_view_psnr);
            curve.points.push_back(
                {target, report.anchors - report.anchors_left_out, report.after, baker.measure(scratch)});
            curve.pictures_kept = report.pictures_kept;
        } catch (const Error& error) {
            if (error.code() != ErrorCode::Difference || (curve.points.size() == 1 && target == targets.back()))
                throw;
            curve.warnings.push_back(error.what());
        }
    }
    std::error_code ignored; // harmless, because the whole folder is removed later
    std::filesystem::remove(scratch, ignored);
    curve.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return curve;
}

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
// Worth of view sensitivities on a real model: how long they take and how often they hold.
//   bench_sensitivity FILE.gsc [ANCHORS]
// Takes ANCHORS (4000) anchors, each with a random camera of the file, turns the view direction by 0.5 and by 1 degree
// towards a random side and compares what changes (drawnChangeReference) with sensitivity times chord.
#include "kernels/threads/stopwatch.h"
#include "kernels/sensitivity/sensitivity.h"
#include <gsc/scene.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

using namespace gsc;

namespace {

// "5 50 95 99 %" of the values, scaled.
void printPercentiles(const char* name, std::vector<double> values, double scale)
{
    std::sort(values.begin(), values.end());
    std::printf("  %-44s", name);
    for (const double p : {0.05, 0.5, 0.95, 0.99})
        std::printf(" %9.4f", values[size_t(p * double(values.size() - 1))] * scale);
    std::printf("\n");
}

std::vector<double> ranks(const std::vector<double>& values)
{
    std::vector<size_t> order(values.size());
    for (size_t i = 0; i < order.size(); ++i)
        order[i] = i;
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
    std::vector<double> rank(values.size());
    for (size_t i = 0; i < order.size(); ++i)
        rank[order[i]] = double(i);
    return rank;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b)
{
    double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    const double n = double(a.size());
    for (size_t i = 0; i < a.size(); ++i) {
        ma += a[i] / n;
        mb += b[i] / n;
    }
    for (size_t i = 0; i < a.size(); ++i) {
        aa += (a[i] - ma) * (a[i] - ma);
        bb += (b[i] - mb) * (b[i] - mb);
        ab += (a[i] - ma) * (b[i] - mb);
    }
    return ab / std::sqrt(aa * bb);
}

struct Anchor {
    uint32_t chunk, local;
    double direction[3], turned[2][3]; // unit; turned by 0.5 and by 1 degree
    double distance;
};

constexpr double kDegrees[2] = {0.5, 1};

std::vector<Anchor> sample(const Scene& scene, uint32_t count)
{
    const ModelView& model = scene.view();
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<Anchor> anchors;
    while (anchors.size() < count) {
        Anchor a{};
        a.chunk = std::uniform_int_distribution<uint32_t>(0, uint32_t(model.params->chunk_count) - 1)(random);
        // chunks by their number of anchors
        if (random() % model.params->max_chunk_anchors >= model.chunks[a.chunk].anchor_count)
            continue;
        a.local = uint32_t(random() % model.chunks[a.chunk].anchor_count);
        const Vec3<float> p = anchorPosition(model, a.chunk, a.local);
        const double* center = scene.cameras()[random() % scene.cameras().size()].position;
        const double v[3] = {p.x - center[0], p.y - center[1], p.z - center[2]};
        a.distance = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        double side[3], along = 0, norm = 0;
        for (int i = 0; i < 3; ++i) {
            a.direction[i] = v[i] / a.distance;
            side[i] = normal(random);
            along += side[i] * a.direction[i];
        }
        for (int i = 0; i < 3; ++i) {
            side[i] -= along * a.direction[i];
            norm += side[i] * side[i];
        }
        for (int t = 0; t < 2; ++t) {
            const double angle = kDegrees[t] * M_PI / 180;
            for (int i = 0; i < 3; ++i)
                a.turned[t][i] = std::cos(angle) * a.direction[i] + std::sin(angle) * side[i] / std::sqrt(norm);
        }
        anchors.push_back(a);
    }
    return anchors;
}

} // namespace

int main(int argc, char** argv)
try {
    if (argc < 2)
        throw Error(ErrorCode::Usage, "bench_sensitivity", "other words", "FILE.gsc [ANCHORS]", "pass these");
    const std::unique_ptr<Scene> scene = Scene::open(argv[1]);
    const ModelView& model = scene->view();
    const int32_t appearance = model.embedding != nullptr ? 0 : -1;

    std::vector<std::vector<float>> direction(model.params->chunk_count), distance(model.params->chunk_count);
    SensitivityScratch scratch;
    Stopwatch watch;
    uint64_t anchors = 0;
    for (uint32_t c = 0; c < model.params->chunk_count; ++c) {
        const uint32_t n = model.chunks[c].anchor_count;
        direction[c].resize(n);
        distance[c].resize(n);
        viewSensitivityCpu(model, c, 0, n, appearance, direction[c].data(), distance[c].data(), scratch);
        anchors += n;
    }
    const double ms = watch.lap();
    std::printf("%s: %llu anchors, %.1f ms on one thread, %.3f us each\n", argv[1], (unsigned long long)anchors, ms,
                ms * 1000 / double(anchors));

    const std::vector<Anchor> samples = sample(*scene, argc > 2 ? uint32_t(std::atoi(argv[2])) : 4000);
    std::vector<double> all_direction, all_distance, view_distance;
    for (const Anchor& a : samples) {
        all_direction.push_back(direction[a.chunk][a.local]);
        all_distance.push_back(distance[a.chunk][a.local]);
        view_distance.push_back(a.distance / sensitivityDistance(model, a.chunk));
    }
    std::printf("  %-44s %9s %9s %9s %9s\n", "percentiles", "5", "50", "95", "99");
    printPercentiles("direction sensitivity, 1/255 per degree", all_direction, 255 * M_PI / 180);
    printPercentiles("distance sensitivity, 1/255 per per cent", all_distance, 2.55);
    printPercentiles("distance of a camera / representative one", view_distance, 1);
    for (int t = 0; t < 2; ++t) {
        const double chord = 2 * std::sin(kDegrees[t] * M_PI / 360);
        std::vector<double> changes, colors, predicted, ratios;
        size_t held = 0, within2 = 0;
        for (const Anchor& a : samples) {
            const double change = drawnChangeReference(model, a.chunk, a.local, appearance, a.direction, a.distance,
                                                       a.turned[t], a.distance);
            const double bound = direction[a.chunk][a.local] * chord;
            held += change <= bound;
            within2 += change <= 2 * bound;
            changes.push_back(change);
            colors.push_back(drawnChangeReference(model, a.chunk, a.local, appearance, a.direction, a.distance,
                                                  a.turned[t], a.distance, {0, 0}));
            predicted.push_back(bound);
            ratios.push_back(bound > 0 ? change / bound : (change > 0 ? 1e9 : 0));
        }
        std::printf("  turned by %.1f degrees: change <= predicted for %.1f %%, <= twice that for %.1f %%; correlation "
                    "%.2f, of ranks %.2f\n",
                    kDegrees[t], 100.0 * double(held) / double(samples.size()),
                    100.0 * double(within2) / double(samples.size()), correlation(changes, predicted),
                    correlation(ranks(changes), ranks(predicted)));
        printPercentiles("change, 1/255", changes, 255);
        printPercentiles("  of the premultiplied colour alone", colors, 255);
        printPercentiles("change / predicted", ratios, 1);
    }
    return 0;
} catch (const Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
}

// SPDX-License-Identifier: Apache-2.0
#include "tests/player/golden_city.h"

#include "convert/sample/sample.h"
#include "tests/support/temporary_folder.h"
#include "tests/player/golden_picture.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <future>

namespace gsc::test {

namespace {

// Hashes and counts are those of the README beside the pictures.
const std::vector<GoldenCity>& goldenCities()
{
    static const std::vector<GoldenCity> cities = {
        {"scaffold_1300000",
         "boruszyn_scaffold",
         1'300'000,
         "9b4d398ceb443c7d91f520cb34a6c62a89f15493f18e81f12c0739ee27bc09cb",
         0.028028166884870195,
         {{0, {726289, 726427}}, {20, {275149, 275306}}}},
        {"octree_1300000",
         "boruszyn_octree",
         1'300'000,
         "270e53568b88347d0462fa66e53763a132f2397b5ac145546b3a5b6c5dd063c6",
         0.027502442730052163,
         {{0, {244929, 245007}}, {20, {148700, 148785}}}},
        {"scaffold_18500000",
         "boruszyn_scaffold",
         18'500'000,
         "8cd44397fcae9e41a41650e9fedd49e5fc33944739f9fccc6c89dc359e1f936e",
         0.028028166884870195,
         {{0, {10057178, 10057520}}}},
        {"octree_18500000",
         "boruszyn_octree",
         18'500'000,
         "d0a5bb3515e233b3ed7b92a934f34b715b8a718c8d1f4263c7a9d805e2e84645",
         0.027502442730052163,
         {{0, {1373418, 1373366}}}},
    };
    return cities;
}

std::string picturesOf(const GoldenCity& city)
{
    return checkpointsRoot() + "/cities/" + city.name;
}

std::string pictureName(size_t frame, size_t eye)
{
    return formatString("%04zu_%s", frame, eye == 0 ? "left" : "right");
}

// By the program of coreutils, which every machine has; empty where it fails. The name goes through a shell.
std::string sha256Of(const std::string& path)
{
    std::FILE* const pipe = ::popen(("sha256sum -b '" + path + "'").c_str(), "r");
    char digits[65] = "";
    const size_t got = pipe == nullptr ? 0 : std::fread(digits, 1, 64, pipe);
    // its output is read to the end, or closing the pipe would end it early
    for (char rest[256]; pipe != nullptr && std::fread(rest, 1, sizeof(rest), pipe) > 0;)
        continue;
    return pipe != nullptr && ::pclose(pipe) == 0 && got == 64 ? digits : "";
}

double secondsSince(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

City::City(const GoldenCity& golden, const std::string& model) : m_golden(golden)
{
    const TemporaryFolder folder;
    ReplicateOptions options;
    options.input = model;
    options.anchors = golden.anchors;
    options.output = folder / golden.name;
    const SampleReport made = replicateCheckpoint(options, {});
    const std::string ply = readCheckpoint(options.output, {}).ply_path;

    const auto start = std::chrono::steady_clock::now();
    std::future<std::string> hash = std::async(std::launch::async, sha256Of, ply);
    m_baked.emplace(options.output);
    const double bake_seconds = secondsSince(start);
    const std::string sha256 = hash.get();
    m_scene = Scene::open(m_baked->path());
    std::printf("%-17s PLY of %.2f GB made in %.1f s, .gsc of %.2f GB in %.1f s, SHA-256 %s\n", golden.name,
                double(made.ply_bytes) / 1e9, made.seconds, double(m_scene->bytes()) / 1e9, bake_seconds,
                sha256.c_str());
    std::fflush(stdout);
    const std::string name = golden.name;
    CAPTURE(name);
    CHECK(sha256 == golden.ply_sha256);

    m_options.model.file = m_baked->path();
    m_options.cameras.file = made.path_file;
    m_options.view.eyes = 2;
    m_options.view.ipd = {golden.ipd, LengthUnit::World};
    m_options.view.width = m_options.view.height = 1024;
    m_options.view.fov_x = std::numbers::pi / 2;
    m_options.frame.background = {0, 0, 0};
    Reporter log({.quiet = true});
    m_shots = chooseShots(*m_scene, m_options.model.file, m_options.cameras, m_options.view, log);
}

CityView City::render(Renderer& backend, size_t frame, Tier tier) const
{
    const Shot& shot = m_shots.at(frame);
    FrameOptions options = frameOptions(*m_scene, m_options.frame);
    options.tier = tier;
    options.appearance = shotAppearance(*m_scene, shot);
    EyeParams eyes[2];
    shotEyes(shot, 2, eyes);
    CityView view;
    float* pixels[2];
    for (size_t e = 0; e < 2; ++e) {
        Image& image = view.eyes[e];
        image.width = eyes[e].width;
        image.height = eyes[e].height;
        image.pixels.resize(size_t(image.width) * image.height * 3);
        pixels[e] = image.pixels.data();
    }
    view.result = gsc::render(backend, eyes, options, pixels);
    return view;
}

std::unique_ptr<City> openCity(const std::string& name)
{
    static bool any = false;
    const auto golden = std::find_if(goldenCities().begin(), goldenCities().end(),
                                     [&](const GoldenCity& city) { return name == city.name; });
    REQUIRE(golden != goldenCities().end());
    const std::string root = checkpointsRoot(), model = root + "/" + golden->model;
    bool there = !root.empty();
    for (const std::string& folder : {model, picturesOf(*golden)})
        if (!root.empty() && !std::filesystem::is_directory(folder)) {
            std::printf("note: %s is missing, the city is not tested\n", folder.c_str());
            there = false;
        }
    any = any || there;
    g_without_models = !any;
    return there ? std::make_unique<City>(*golden, model) : nullptr;
}

void checkFrame(const City& city, const CityFrame& frame, const CityView& view, const char* renderer,
                const PictureBar& bar)
{
    for (size_t e = 0; e < 2; ++e) {
        const std::string name = pictureName(frame.index, e);
        const std::string what = formatString("%-17s %-10s %-10s", city.golden().name, name.c_str(), renderer);
        const Image picture = readImage(picturesOf(city.golden()) + "/" + name + ".png");
        REQUIRE(picture.width == view.eyes[e].width);
        REQUIRE(picture.height == view.eyes[e].height);
        const ImageDifference difference = compareImages(viewOf(picture), viewOf(view.eyes[e]));
        const uint64_t anchors = view.result.eyes[e].anchors_visible;
        std::printf("%s %s, %llu anchors (the trainers' %llu), both eyes %.0f ms\n", what.c_str(),
                    differenceText(difference).c_str(), static_cast<unsigned long long>(anchors),
                    static_cast<unsigned long long>(frame.anchors_visible[e]), view.result.times.total);
        std::fflush(stdout);
        CAPTURE(what);
        CHECK(difference.psnr >= bar.psnr);
        CHECK(difference.max_error <= bar.worst_pixel);
        CHECK(anchors == frame.anchors_visible[e]);
    }
}

void checkViews(const City& city, size_t frame, const CityView& view, const CityView& expected, const char* renderers,
                double least_psnr, PooledDifference& pooled)
{
    for (size_t e = 0; e < 2; ++e) {
        const std::string name = pictureName(frame, e);
        const std::string what = formatString("%-17s %-10s %s", city.golden().name, name.c_str(), renderers);
        const ImageDifference difference = compareImages(viewOf(expected.eyes[e]), viewOf(view.eyes[e]));
        const uint64_t anchors = view.result.eyes[e].anchors_visible,
                       expected_anchors = expected.result.eyes[e].anchors_visible;
        std::printf("%s %s, %llu anchors and %llu, both eyes %.0f ms and %.0f\n", what.c_str(),
                    differenceText(difference).c_str(), static_cast<unsigned long long>(anchors),
                    static_cast<unsigned long long>(expected_anchors), view.result.times.total,
                    expected.result.times.total);
        std::fflush(stdout);
        pooled.add(difference);
        CAPTURE(what);
        CHECK(difference.psnr >= least_psnr);
        CHECK(anchors == expected_anchors);
    }
}

} // namespace gsc::test

// SPDX-License-Identifier: Apache-2.0
// Explicit Gaussians: fit, drawing and files.
#include "convert/export/gaussian_files.h"
#include "convert/export/gaussian_fit.h"
#include "convert/export/gaussian_render.h"
#include "convert/export/sog/codebook.h"
#include "convert/export/sog/zip_bundle.h"
#include "convert/export/symmetric.h"
#include "convert/input/torch/zip_archive.h"
#include <gsc/error.h>
#include <gsc/camera.h>
#include "runtime/metrics/metrics.h"
#include "tests/export/random_set.h"
#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr double kNowhere[3] = {};

EyeParams eyeAround(double angle)
{
    Camera camera;
    const double s = std::sin(angle), c = std::cos(angle);
    const double axes[9] = {c, 0, s, 0, 1, 0, -s, 0, c}; // looks inwards from a circle of 9 units
    std::copy_n(axes, 9, camera.rotation);
    camera.translation[2] = 9;
    camera.width = 96;
    camera.height = 80;
    camera.fov_x = 1.0;
    camera.fov_y = 2 * std::atan(std::tan(0.5) * 80 / 96);
    return eyeParams(camera, kNowhere);
}

std::string written(void (*write)(const GaussianSet&, const PieceSink&), const GaussianSet& set)
{
    std::string file;
    write(set, [&](std::span<const std::byte> piece) {
        file.append(reinterpret_cast<const char*>(piece.data()), piece.size());
    });
    return file;
}

std::string writtenSpz(const GaussianSet& set, int version)
{
    std::string file;
    writeGaussianSpz(
        set,
        [&](std::span<const std::byte> piece) {
            file.append(reinterpret_cast<const char*>(piece.data()), piece.size());
        },
        version);
    return file;
}

#if GSC_HAVE_WEBP
std::string writtenSog(const GaussianSet& set, int threads)
{
    std::string file;
    writeGaussianSog(
        set,
        [&](std::span<const std::byte> piece) {
            file.append(reinterpret_cast<const char*>(piece.data()), piece.size());
        },
        threads);
    return file;
}
#endif

template <typename T>
T valueAt(const std::string& file, size_t offset)
{
    T value{};
    REQUIRE(offset + sizeof(T) <= file.size());
    std::memcpy(&value, file.data() + offset, sizeof(T));
    return value;
}

float farthest(const std::vector<float>& a, const std::vector<float>& b)
{
    REQUIRE(a.size() == b.size());
    float most = 0;
    for (size_t i = 0; i < a.size(); ++i)
        most = std::max(most, std::abs(a[i] - b[i]));
    return most;
}

GaussianSet fitted(const ModelView& model, const std::vector<FitView>& views, const FitOptions& options)
{
    GaussianSet set;
    fitGaussians(
        model, views, options, [&set](const GaussianSet& part) { append(set, part); }, [](uint64_t, uint64_t) {});
    return set;
}

double psnrOfFit(const ModelView& model, const std::vector<FitView>& views, const EyeParams& judge, int degree)
{
    const RasterConstants rules = rasterConstants(*model.params, 0);
    const GaussianSet set = fitted(model, views, {degree, 0, views.size() == 1, rules});
    const std::unique_ptr<Renderer> exact = makeCpuRenderer(CpuPath::Fast, 0);
    exact->load(model);
    FrameOptions options;
    options.tier = Tier::Exact;
    const auto wanted = render(*exact, {judge}, options);
    std::vector<float> drawn(wanted[0].pixels.size());
    const float black[3] = {};
    GaussianRenderer(set, kNowhere, 0).draw(judge, rules, black, drawn.data());
    return compareImages({wanted[0].pixels.data(), judge.width, judge.height},
                         {drawn.data(), judge.width, judge.height})
        .psnr;
}

} // namespace

TEST_CASE("spherical harmonics: orthonormal, and their signs where y and z change theirs")
{
    std::array<std::array<double, kMostShValues>, kMostShValues> products{};
    constexpr int kSteps = 200;
    for (int i = 0; i < kSteps; ++i) // by equal areas
        for (int j = 0; j < kSteps; ++j) {
            const double z = -1 + (2 * i + 1.0) / kSteps, phi = 2 * std::numbers::pi * j / kSteps,
                         r = std::sqrt(1 - z * z);
            const float d[3] = {float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)};
            const float flipped[3] = {d[0], -d[1], -d[2]};
            float basis[kMostShValues], other[kMostShValues];
            shBasis(3, d, basis);
            shBasis(3, flipped, other);
            for (size_t a = 0; a < kMostShValues; ++a) {
                if (std::abs(other[a] - kShFlipYz[a] * basis[a]) > 1e-5f)
                    FAIL("coefficient ", a);
                for (size_t b = 0; b < kMostShValues; ++b)
                    products[a][b] += double(basis[a]) * basis[b] * 4 * std::numbers::pi / (kSteps * kSteps);
            }
        }
    for (size_t a = 0; a < kMostShValues; ++a)
        for (size_t b = 0; b < kMostShValues; ++b)
            CHECK(products[a][b] == doctest::Approx(a == b ? 1 : 0).epsilon(2e-3));
}

TEST_CASE("spherical harmonics: the values of 3DGS' own formulas at one direction")
{
    // graphdeco's constants written out for (2, -3, 6) / 7
    const float d[3] = {2 / 7.0f, -3 / 7.0f, 6 / 7.0f};
    float basis[kMostShValues];
    shBasis(3, d, basis);
    CHECK(basis[0] == doctest::Approx(0.28209479));
    CHECK(basis[1] == doctest::Approx(0.48860251 * 3 / 7));
    CHECK(basis[2] == doctest::Approx(0.48860251 * 6 / 7));
    CHECK(basis[3] == doctest::Approx(-0.48860251 * 2 / 7));
    CHECK(basis[4] == doctest::Approx(1.09254843 * -6 / 49));
    CHECK(basis[5] == doctest::Approx(-1.09254843 * -18 / 49));
    CHECK(basis[6] == doctest::Approx(0.31539157 * (72 - 4 - 9) / 49));
    CHECK(basis[7] == doctest::Approx(-1.09254843 * 12 / 49));
    CHECK(basis[8] == doctest::Approx(0.54627422 * (4 - 9) / 49));
    CHECK(basis[9] == doctest::Approx(-0.59004359 * -3 * (12 - 9) / 343));
    CHECK(basis[10] == doctest::Approx(2.89061144 * -36 / 343));
    CHECK(basis[11] == doctest::Approx(-0.45704580 * -3 * (144 - 4 - 9) / 343));
    CHECK(basis[12] == doctest::Approx(0.37317633 * 6 * (72 - 12 - 27) / 343));
    CHECK(basis[13] == doctest::Approx(-0.45704580 * 2 * (144 - 4 - 9) / 343));
    CHECK(basis[14] == doctest::Approx(1.44530572 * 6 * (4 - 9) / 343));
    CHECK(basis[15] == doctest::Approx(-0.59004359 * 2 * (4 - 27) / 343));
}

TEST_CASE("axes of an ellipsoid give its covariance back, and systems are solved")
{
    Random random(3);
    for (int i = 0; i < 200; ++i) {
        const bool round = i % 10 == 0;
        double s[3], m[3][3], c[6];
        for (double& v : s)
            v = round ? 0.5 : std::exp(random.uniform(-6, 1));
        for (auto& row : m)
            for (double& v : row)
                v = random.normal();
        size_t at = 0;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = a; b < 3; ++b) {
                c[at] = 0;
                for (size_t k = 0; k < 3; ++k)
                    c[at] += round ? (a == b ? 0.25 / 3 : 0) : m[a][k] * m[b][k] * s[k];
                ++at;
            }
        double q[4], d[3];
        ellipsoidAxes(c, q, d);
        CHECK(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] == doctest::Approx(1).epsilon(1e-9));
        const double r[3][3] = {
            {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2])},
            {2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1])},
            {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
        at = 0;
        double worst = 0;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = a; b < 3; ++b) {
                double value = 0;
                for (size_t k = 0; k < 3; ++k)
                    value += r[a][k] * r[b][k] * d[k] * d[k];
                worst = std::max(worst, std::abs(value - c[at++]));
            }
        CHECK(worst <= 1e-9 * (c[0] + c[3] + c[5]));
    }
    double a[6] = {4, 2, 5, 1, 3, 6},
           b[6] = {4 * 1 + 2 * 2 + 1 * 3, 0, 2 * 1 + 5 * 2 + 3 * 3, 0, 1 * 1 + 3 * 2 + 6 * 3, 0};
    REQUIRE(solveSymmetric(a, b, 3, 2));
    for (size_t i = 0; i < 3; ++i) {
        CHECK(b[2 * i] == doctest::Approx(double(i + 1)));
        CHECK(b[2 * i + 1] == 0);
    }
    double flat[3] = {1, 1, 1}, any[2] = {1, 1};
    CHECK_FALSE(solveSymmetric(flat, any, 2, 1));
}

TEST_CASE("the best are kept in their order")
{
    GaussianSet set = randomSet(1, 50);
    const GaussianSet all = set;
    keepBest(set, 7);
    REQUIRE(set.size() == 7);
    CHECK(set.color.size() == 7 * set.colorValues());
    size_t from = 0;
    for (size_t i = 0; i < 7; ++i) {
        while (all.score[from] != set.score[i])
            ++from;
        CHECK(std::equal(set.rotation.begin() + long(4 * i), set.rotation.begin() + long(4 * i + 4),
                         all.rotation.begin() + long(4 * from)));
        CHECK(std::count_if(all.score.begin(), all.score.end(), [&](float s) { return s > set.score[i]; }) < 7);
    }
}

TEST_CASE("SPZ: read back to within its steps, every degree")
{
    for (int degree = 0; degree <= 3; ++degree) {
        CAPTURE(degree);
        const GaussianSet set = randomSet(degree, 300);
        const std::string file = writtenSpz(set, 3);
        const GaussianSet back = readGaussianSpz(std::as_bytes(std::span(file)), "a.spz");
        REQUIRE(back.size() == set.size());
        CHECK(back.degree == degree);
        CHECK(farthest(back.position, set.position) < 1e-5f);
        CHECK(farthest(back.log_scale, set.log_scale) <= 1 / 32.0f + 1e-4f);
        CHECK(farthest(back.opacity, set.opacity) <= 0.5f / 255 + 1e-4f);
        float worst = 0, colors = 0;
        for (size_t i = 0; i < set.size(); ++i) {
            float dot = 0;
            for (size_t c = 0; c < 4; ++c)
                dot += back.rotation[4 * i + c] * set.rotation[4 * i + c];
            worst = std::max(worst, 1 - std::abs(dot));    // a quaternion and its negative are the same
            for (size_t c = 0; c < set.colorValues(); ++c) // steps: 1 / 38.25, 1 / 16 and 1 / 8
                colors = std::max(
                    colors, std::abs(back.color[i * set.colorValues() + c] - set.color[i * set.colorValues() + c]) /
                                (c < 3    ? 0.5f / 38.25f
                                 : c < 12 ? 0.5f / 16 + 0.5f / 128
                                          : 0.5f / 8 + 0.5f / 128));
        }
        CHECK(worst < 1e-5f);
        CHECK(colors <= 1.01f);
        CHECK_THROWS_AS((void)readGaussianSpz(std::as_bytes(std::span(file)).first(file.size() / 2), "a.spz"), Error);
    }
    GaussianSet far = randomSet(0, 1);
    far.position[1] = 9e6f;
    CHECK_THROWS_AS(writtenSpz(far, 3), Error);
}

#if GSC_HAVE_ZSTD
TEST_CASE("SPZ version 4: the values of version 3 behind a plain header, and no damage passes")
{
    for (int degree = 0; degree <= 3; ++degree) {
        CAPTURE(degree);
        const GaussianSet set = randomSet(degree, 300);
        const std::string file = writtenSpz(set, 4), older = writtenSpz(set, 3);
        CHECK(file.starts_with("NGSP"));
        CHECK(valueAt<uint32_t>(file, 4) == 4);
        CHECK(valueAt<uint32_t>(file, 8) == 300);
        CHECK(int(valueAt<uint8_t>(file, 12)) == degree);
        CHECK(int(valueAt<uint8_t>(file, 14)) == 0);
        const size_t streams = valueAt<uint8_t>(file, 15);
        CHECK(streams == (degree == 0 ? 5 : 6));
        CHECK(valueAt<uint32_t>(file, 16) == 32);
        size_t bytes = 32 + 16 * streams;
        const uint64_t raw[6] = {2700, 300, 900, 900, 1200, 900 * (shValues(degree) - 1)};
        for (size_t i = 0; i < streams; ++i) {
            CHECK(valueAt<uint32_t>(file, bytes) == 0xfd2fb528); // magic of a Zstandard frame
            CHECK(valueAt<uint64_t>(file, 32 + 16 * i + 8) == raw[i]);
            bytes += valueAt<uint64_t>(file, 32 + 16 * i);
        }
        CHECK(bytes == file.size());
        const auto read = [](const std::string& text) {
            return readGaussianSpz(std::as_bytes(std::span(text)), "a.spz");
        };
        const GaussianSet back = read(file), wanted = read(older);
        CHECK(back.degree == degree);
        CHECK(back.position == wanted.position);
        CHECK(back.log_scale == wanted.log_scale);
        CHECK(back.rotation == wanted.rotation);
        CHECK(back.opacity == wanted.opacity);
        CHECK(back.color == wanted.color);
        for (size_t size = 0; size < file.size(); size += size < 128 ? 1 : 97)
            CHECK_THROWS_AS((void)read(file.substr(0, size)), Error);
        CHECK_THROWS_AS((void)read(file + "!"), Error);
        for (const size_t at : {4, 8, 9, 10, 11, 12, 15, 16, 17, 18, 19, 32, 39, 40, 47}) {
            CAPTURE(at);
            std::string damaged = file;
            damaged[at] = char(uint8_t(damaged[at]) + 1);
            CHECK_THROWS_AS((void)read(damaged), Error);
        }
    }
}
#endif

#if GSC_HAVE_WEBP
TEST_CASE("SOG: read back to within its steps in another order, every degree, threads change nothing")
{
    for (int degree = 0; degree <= 3; ++degree) {
        CAPTURE(degree);
        const GaussianSet set = randomSet(degree, 300);
        const std::string file = writtenSog(set, 1);
        CHECK(file == writtenSog(set, 3));
        const GaussianSet back = readGaussianSog(std::as_bytes(std::span(file)), "a.sog");
        REQUIRE(back.size() == set.size());
        CHECK(back.degree == degree);
        const size_t values = set.colorValues();
        float place = 0, turn = 0, size = 0, color = 0, opacity = 0;
        std::vector<bool> met(set.size());
        for (size_t i = 0; i < set.size(); ++i) { // its nearest is the one it was
            size_t from = 0;
            float least = 1e9f;
            for (size_t j = 0; j < set.size(); ++j) {
                float apart = 0;
                for (size_t c = 0; c < 3; ++c)
                    apart = std::max(apart, std::abs(back.position[3 * i + c] - set.position[3 * j + c]));
                if (apart < least) {
                    least = apart;
                    from = j;
                }
            }
            met[from] = true;
            place = std::max(place, least);
            float dot = 0;
            for (size_t c = 0; c < 4; ++c)
                dot += back.rotation[4 * i + c] * set.rotation[4 * from + c];
            turn = std::max(turn, 1 - std::abs(dot));
            for (size_t c = 0; c < 3; ++c)
                size = std::max(size, std::abs(back.log_scale[3 * i + c] - set.log_scale[3 * from + c]));
            for (size_t c = 0; c < values; ++c)
                color = std::max(color, std::abs(back.color[i * values + c] - set.color[from * values + c]));
            opacity = std::max(opacity, std::abs(back.opacity[i] - set.opacity[from]));
        }
        CHECK(std::count(met.begin(), met.end(), true) == 300);
        CHECK(place <
              41 * 8.0f / 65535); // half a step of logarithms from -3.7 to 3.7, at 40 from the origin, and rounding
        CHECK(turn < 5e-5f);
        CHECK(size < 0.04f);   // 256 steps for what lies between -6 and 0
        CHECK(color < 0.012f); // and between -0.9 and 0.9
        CHECK(opacity <= 0.5f / 255 + 1e-4f);
        CHECK_THROWS_AS((void)readGaussianSog(std::as_bytes(std::span(file)).first(file.size() / 2), "a.sog"), Error);
        if (degree == 0)
            continue;
        // a palette whose pixels, counted in 64 bits, are few
        std::vector<std::pair<std::string, std::vector<std::byte>>> members;
        const ZipArchive zip(std::as_bytes(std::span(file)), "a.sog");
        for (const std::string& name : zip.members())
            members.emplace_back(name, zip.read(name));
        auto meta =
            nlohmann::json::parse(reinterpret_cast<const char*>(members[0].second.data()),
                                  reinterpret_cast<const char*>(members[0].second.data()) + members[0].second.size());
        meta.at("shN").at("count") = (uint64_t(1) << 63) / ((values - 3) / 3) * 2 + 1;
        const std::string text = meta.dump();
        const auto bytes = std::as_bytes(std::span(text));
        members[0].second.assign(bytes.begin(), bytes.end());
        CHECK_THROWS_WITH_AS((void)readGaussianSog(zipBundle(members), "a.sog"),
                             doctest::Contains("expected at most 65536"), Error);
    }
}

TEST_CASE("SOG: one Gaussian, and many of one kind")
{
    for (const size_t count : {1, 5}) {
        GaussianSet set = randomSet(1, 1);
        while (set.size() < count) {
            set.position.insert(set.position.end(), set.position.begin(), set.position.begin() + 3);
            set.log_scale.insert(set.log_scale.end(), set.log_scale.begin(), set.log_scale.begin() + 3);
            set.rotation.insert(set.rotation.end(), set.rotation.begin(), set.rotation.begin() + 4);
            set.color.insert(set.color.end(), set.color.begin(), set.color.begin() + 12);
            set.opacity.push_back(set.opacity[0]);
        }
        const std::string file = writtenSog(set, 0);
        const GaussianSet back = readGaussianSog(std::as_bytes(std::span(file)), "a.sog");
        CHECK(farthest(back.position, set.position) < 1e-5f);
        CHECK(farthest(back.log_scale, set.log_scale) < 1e-6f);
        CHECK(farthest(back.color, set.color) < 1e-6f);
    }
}

TEST_CASE("palette: alike vectors share a centre, and the error falls with the number of centres")
{
    Random random(5);
    std::vector<float> vectors;
    for (int i = 0; i < 400; ++i)
        for (int c = 0; c < 9; ++c)
            vectors.push_back(float(i % 4) * float(c) + (i < 200 ? 0.0f : 0.001f * random.uniform()));
    const auto errorOf = [&vectors](const Palette& palette) {
        double sum = 0;
        for (size_t i = 0; i < vectors.size(); ++i) {
            const float apart = palette.centers[palette.labels[i / 9] * 9 + i % 9] - vectors[i];
            sum += double(apart) * apart;
        }
        return sum;
    };
    const Palette four = makePalette(vectors, 9, 4), many = makePalette(vectors, 9, 4096);
    CHECK(four.centers.size() == 4 * 9);
    for (size_t i = 4; i < 400; ++i)
        CHECK(four.labels[i] == four.labels[i % 4]);
    CHECK(errorOf(four) < 1e-3);
    CHECK(errorOf(makePalette(vectors, 9, 2)) > 1);
    CHECK(errorOf(many) < 1e-9);
    CHECK(many.centers.size() == (4 + 200) * 9);
}

TEST_CASE("codebook: as good as the best for uniform numbers, exact for few")
{
    std::vector<float> numbers;
    for (int i = 0; i < 25600; ++i)
        numbers.push_back(float(i) / 25600);
    const Codebook book = makeCodebook(numbers);
    double squares = 0;
    for (const float number : numbers)
        squares += std::pow(book.values[book.nearest(number)] - number, 2);
    CHECK(std::sqrt(squares / 25600) < 1.1 / (256 * std::sqrt(12)));
    const std::vector<float> few = {-3, 0.25f, 1e6f, 1e6f};
    const Codebook exact = makeCodebook(few);
    for (const float number : few)
        CHECK(exact.values[exact.nearest(number)] == number);
}
#endif

TEST_CASE("PLY: the header of 3DGS, and rows of floats")
{
    const GaussianSet set = randomSet(2, 5000); // more than a piece
    const std::string file = written(writeGaussianPly, set);
    const size_t data = file.find("end_header\n") + 11;
    CHECK(file.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 5000\nproperty float x\n"));
    CHECK(file.find("property float f_rest_23\nproperty float opacity\n") != std::string::npos);
    CHECK(gaussianPlyHeader(2, 1).size() == data); // equal for any number of Gaussians
    CHECK(gaussianPlyHeader(2, UINT64_MAX).size() == data);
    CHECK(file.starts_with(gaussianPlyHeader(2, 5000)));
    constexpr size_t kRow = 9 + 24 + 8;
    REQUIRE(file.size() == data + 5000 * kRow * 4);
    const size_t i = 4321;
    const auto at = [&](size_t column) { return valueAt<float>(file, data + (i * kRow + column) * 4); };
    CHECK(at(1) == set.position[3 * i + 1]);
    CHECK(at(7) == set.color[i * 27 + 1]);
    CHECK(at(9 + 8 + 2) == set.color[i * 27 + 3 * 3 + 1]); // green's third above degree 0
    CHECK(1 / (1 + std::exp(-at(33))) == doctest::Approx(set.opacity[i]));
    CHECK(at(34) == set.log_scale[3 * i]);
    CHECK(at(40) == set.rotation[4 * i + 3]);
}

TEST_CASE("GLB: chunks, accessors and bounds")
{
    const GaussianSet set = randomSet(1, 70);
    const std::string file = written(writeGaussianGlb, set);
    CHECK(file.starts_with("glTF"));
    CHECK(valueAt<uint32_t>(file, 8) == file.size());
    const auto json_bytes = valueAt<uint32_t>(file, 12);
    CHECK(json_bytes % 4 == 0);
    const auto json = nlohmann::json::parse(file.substr(20, json_bytes));
    const size_t binary = 20 + json_bytes + 8;
    CHECK(valueAt<uint32_t>(file, 20 + json_bytes) + binary == file.size());
    const auto& primitive = json["meshes"][0]["primitives"][0];
    CHECK(primitive["extensions"]["KHR_gaussian_splatting"]["kernel"] == "ellipse");
    const auto value = [&](const std::string& name, size_t i, size_t c) {
        const auto& accessor =
            json["accessors"][primitive["attributes"]["KHR_gaussian_splatting:" + name].get<size_t>()];
        CHECK(accessor["count"] == 70);
        const std::string type = accessor["type"];
        const size_t each = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4;
        const auto& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
        return valueAt<float>(file, binary + view["byteOffset"].get<size_t>() + (i * each + c) * 4);
    };
    CHECK(value("ROTATION", 9, 3) == set.rotation[4 * 9]);
    CHECK(value("SCALE", 8, 1) == doctest::Approx(std::exp(set.log_scale[3 * 8 + 1])));
    CHECK(value("OPACITY", 69, 0) == set.opacity[69]);
    CHECK(value("SH_DEGREE_1_COEF_2", 33, 0) == set.color[33 * 12 + 9]);
    float least = 1e9f;
    for (size_t i = 0; i < 70; ++i)
        least = std::min(least, set.position[3 * i + 2]);
    CHECK(json["accessors"][0]["min"][2].get<float>() == least);
}

TEST_CASE("fit: one view is drawn as it was, colours follow the view with the degree, threads change nothing")
{
    const SyntheticModel model({.anchors = 300, .log_scale = -2.2f, .extent = 2});
    const EyeParams judge = eyeAround(0.15);
    CHECK(psnrOfFit(model.view(), {{judge, -1}}, judge, 0) > 60);

    std::vector<FitView> views;
    for (int i = 0; i < 16; ++i)
        views.push_back({eyeAround(0.1 * i - 0.7), -1});
    const double flat = psnrOfFit(model.view(), views, judge, 0), curved = psnrOfFit(model.view(), views, judge, 3);
    MESSAGE("degree 0 ", flat, " dB, degree 3 ", curved, " dB");
    CHECK(curved > flat + 0.2);

    const RasterConstants rules = rasterConstants(*model.view().params, 0);
    const GaussianSet one = fitted(model.view(), views, {2, 1, false, rules});
    const GaussianSet many = fitted(model.view(), views, {2, 3, false, rules});
    CHECK(one.color == many.color);
    CHECK(one.rotation == many.rotation);
    CHECK(one.opacity == many.opacity);
    CHECK(one.size() > 1000);
}

TEST_CASE("fit: what share of its views draws an anchor's level")
{
    SyntheticOptions options = octree(LevelRule::Round, 400);
    options.extent = 2;
    const SyntheticModel model(options);
    const RasterConstants rules = rasterConstants(*model.view().params, 0);
    std::vector<FitView> views;
    for (int i = 0; i < 4; ++i)
        views.push_back({eyeAround(0.3 * i), -1});
    const GaussianSet one = fitted(model.view(), {views[0]}, {0, 0, false, rules});
    const GaussianSet all = fitted(model.view(), views, {0, 0, false, rules});
    REQUIRE(one.shown.size() == one.size());
    CHECK(std::ranges::all_of(one.shown, [](float share) { return share == 1; })); // others are not in the set
    size_t some = 0;
    for (size_t i = 0; i < all.size(); ++i) {
        CHECK((all.shown[i] > 0 && all.shown[i] <= 1));
        if (all.level[i] == 0)
            CHECK(all.shown[i] == 1);
        some += all.shown[i] < 1;
    }
    CHECK(some > 0);
}

TEST_CASE("fit: shapes that turn with the view do not grow into each other")
{
    const SyntheticModel model({.anchors = 300, .log_scale = -2.2f, .extent = 2});
    const RasterConstants rules = rasterConstants(*model.view().params, 0);
    std::vector<FitView> views;
    for (int i = 0; i < 16; ++i)
        views.push_back({eyeAround(0.4 * i), -1});
    const auto volumes = [](const GaussianSet& set) {
        double sum = 0;
        for (const float value : set.log_scale)
            sum += double(value);
        return sum / double(set.size());
    };
    double alone = 0;
    for (const FitView& view : views)
        alone += volumes(fitted(model.view(), {view}, {0, 0, true, rules})) / double(views.size());
    const double together = volumes(fitted(model.view(), views, {0, 0, false, rules}));
    MESSAGE("logarithms of volumes: one view ", alone, ", all ", together);
    CHECK(together < alone + 0.3);
}

// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_row.h"

#include "format/error.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

namespace gsc {

namespace {

using Json = nlohmann::json;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr uint64_t kMaxFrames = 10'000'000;

// A value of the line and how it was reached, for messages.
class Field {
public:
    Field(const Json& value, std::string path, const std::string& where)
        : m_value(&value), m_path(std::move(path)), m_where(&where)
    {
    }

    [[nodiscard]] Field at(const char* key) const
    {
        if (!m_value->is_object())
            fail("an object");
        const std::string path = m_path.empty() ? key : m_path + "." + key;
        const auto found = m_value->find(key);
        if (found == m_value->end())
            throw Error(ErrorCode::InvalidFile,
                        *m_where + ": has no " + path +
                            ", expected a whole line of gsc.run/1; remove the line or run it again");
        return {*found, path, *m_where};
    }
    [[nodiscard]] bool has(const char* key) const { return m_value->is_object() && m_value->contains(key); }
    [[nodiscard]] size_t length() const
    {
        if (!m_value->is_array() || m_value->empty())
            fail("an array that is not empty");
        return m_value->size();
    }
    [[nodiscard]] bool null() const { return m_value->is_null(); }

    [[nodiscard]] std::string text() const
    {
        if (!m_value->is_string())
            fail("a text");
        return m_value->get<std::string>();
    }
    [[nodiscard]] std::string name() const
    {
        std::string value = text();
        if (value.empty())
            fail("a text that is not empty");
        return value;
    }
    [[nodiscard]] std::string textOrNull() const { return null() ? std::string() : text(); }
    [[nodiscard]] bool boolean() const
    {
        if (!m_value->is_boolean())
            fail("true or false");
        return m_value->get<bool>();
    }
    [[nodiscard]] uint64_t count(uint64_t smallest = 0, uint64_t largest = uint64_t(1) << 53) const
    {
        const bool whole = m_value->is_number_unsigned();
        if (!whole || m_value->get<uint64_t>() < smallest || m_value->get<uint64_t>() > largest)
            fail(formatString("a whole number from %llu to %llu", static_cast<unsigned long long>(smallest),
                              static_cast<unsigned long long>(largest)));
        return m_value->get<uint64_t>();
    }
    [[nodiscard]] double number() const
    {
        if (!m_value->is_number() || !std::isfinite(m_value->get<double>()))
            fail("a finite number");
        return m_value->get<double>();
    }
    [[nodiscard]] double positive() const // or zero
    {
        if (number() < 0)
            fail("a number that is not negative");
        return number();
    }
    [[nodiscard]] double aboveZero() const
    {
        if (number() <= 0)
            fail("a number above 0");
        return number();
    }
    [[nodiscard]] double decibels() const { return null() ? kInfinity : number(); }
    // Null says that images are equal, which an error of them contradicts.
    [[nodiscard]] double decibelsOf(double max_error) const
    {
        if (!m_value->is_number() && !(null() && max_error == 0))
            fail("a number, or null where max_error is 0");
        return decibels();
    }
    [[nodiscard]] std::optional<double> positiveOrNull() const
    {
        return null() ? std::nullopt : std::optional(positive());
    }
    [[nodiscard]] std::optional<uint64_t> countOrNull() const { return null() ? std::nullopt : std::optional(count()); }

    // `of_null` is what null stands for.
    [[nodiscard]] std::vector<double> series(size_t length, double of_null) const
    {
        if (!m_value->is_array() || m_value->size() != length)
            fail(formatString("an array of %zu values", length));
        std::vector<double> values;
        values.reserve(m_value->size());
        for (size_t i = 0; i < m_value->size(); ++i) {
            const Field value((*m_value)[i], formatString("%s[%zu]", m_path.c_str(), i), *m_where);
            values.push_back(value.null() ? of_null : value.number());
        }
        return values;
    }

    [[noreturn]] void fail(const std::string& expected) const
    {
        std::string found = m_value->dump();
        if (found.size() > 60)
            found = found.substr(0, 57) + "...";
        throw Error(ErrorCode::InvalidFile, *m_where + ": " + m_path + " is " + found + ", expected " + expected +
                                                "; remove the line or run it again");
    }

private:
    const Json* m_value;
    std::string m_path;
    const std::string* m_where;
};

RunSpread readSpread(const Field& field)
{
    return {field.at("mean").positive(), field.at("median").positive(), field.at("p95").positive(),
            field.at("p99").positive(), field.at("max").positive()};
}

RunConfig readConfig(const Field& field)
{
    RunConfig config;
    config.id = field.at("id").name();
    config.trajectory = field.at("trajectory").name();
    config.cameras = field.at("cameras").text();
    config.frames = field.at("frames").count(1, kMaxFrames);
    config.warmup = field.at("warmup").count();
    config.cold = field.at("cold").boolean();
    config.policy = field.at("policy").name();
    config.max_depth = field.at("max_depth").countOrNull();
    config.guidance = field.at("guidance").textOrNull();
    config.bound = field.at("bound").positiveOrNull();
    config.decode_budget = field.at("decode_budget").countOrNull();
    config.cache_budget = field.at("cache_budget").countOrNull();
    for (const char* cache :
         {"cut", "order"}) // of earlier versions; without them such a row would pass for a plain run
        if (field.has(cache) && field.at(cache).boolean())
            field.at(cache).fail("false: this version has no such cache");
    config.tier = field.at("tier").name();
    config.lod_bias = field.at("lod_bias").number();
    if (field.has("lod_fade")) // older rows have none
        config.lod_fade = field.at("lod_fade").number();
    if (field.has("lod_hysteresis"))
        config.lod_hysteresis = field.at("lod_hysteresis").number();
    config.stereo = field.at("stereo").name();
    config.eyes = field.at("eyes").count(1, 2);
    config.ipd = field.at("ipd").positiveOrNull();
    if (const Field size = field.at("size"); !size.null()) {
        const std::vector<double> pixels = size.series(2, 0);
        if (!(pixels[0] >= 1 && pixels[1] >= 1 && pixels[0] <= 1e6 && pixels[1] <= 1e6))
            size.fail("width and height in pixels");
        config.width = uint64_t(pixels[0]);
        config.height = uint64_t(pixels[1]);
    }
    config.fov_degrees = field.at("fov_degrees").positiveOrNull();
    config.near_z = field.at("near").positiveOrNull();
    config.appearance = field.at("appearance").countOrNull();
    config.threads = field.at("threads").count();
    config.vram_budget = field.at("vram_budget").countOrNull();
    return config;
}

RunAccuracy readAccuracy(const Field& field)
{
    RunAccuracy accuracy;
    const Field psnr = field.at("psnr");
    accuracy.max_error = field.at("max_error").positive();
    accuracy.psnr_pooled = psnr.at("pooled").decibelsOf(accuracy.max_error);
    accuracy.psnr_p1 = psnr.at("p1").decibels(); // of many images one may differ
    accuracy.psnr_min = psnr.at("min").decibelsOf(accuracy.max_error);
    if (const Field temporal = field.at("temporal"); !temporal.null())
        accuracy.temporal_max = temporal.at("max").positiveOrNull();
    if (const Field ssim = field.at("ssim"); !ssim.null() && !ssim.at("mean").null())
        accuracy.ssim_mean = ssim.at("mean").number();
    if (const Field flip = field.at("flip"); !flip.null())
        accuracy.flip_mean = flip.at("mean").positiveOrNull();
    return accuracy;
}

RunRow readRow(const Field& line)
{
    RunRow row;
    const Field tool = line.at("tool"), file = line.at("file"), device = line.at("device"), reuse = line.at("reuse");
    row.tool = tool.at("name").name();
    row.version = tool.at("version").text();
    row.commit = tool.at("commit").textOrNull();
    row.label = line.at("label").text();
    row.file = file.at("path").name();
    row.file_bytes = file.at("bytes").count();
    row.anchors = file.at("anchors").count();
    row.backend = line.at("backend").name();
    row.device = device.at("name").text();
    row.driver = device.at("driver").textOrNull();
    row.device_memory = device.at("memory_bytes").count();
    row.config = readConfig(line.at("config"));
    row.rendered_tier = line.has("rendered_tier") ? line.at("rendered_tier").name() : row.config.tier;
    row.reference = line.has("reference") ? line.at("reference").text() : std::string();
    const Field times = line.at("ms");
    row.wall = readSpread(times.at("wall"));
    row.wall.median = times.at("wall").at("median").aboveZero(); // a run takes time
    row.device_ms = readSpread(times.at("device"));
    row.decode_ms = times.at("stages").at("decode").at("median").positive();
    row.least_ms = row.most_ms = row.wall.median;
    row.accuracy = readAccuracy(line.at("accuracy"));
    row.decoded_per_frame = reuse.at("decoded_per_frame").at("mean").positive();
    row.hit_rate = reuse.at("hit_rate").positiveOrNull();
    row.cache_bytes = reuse.at("cache_bytes").count();
    row.peak_bytes = line.at("peak_bytes").count();
    const Field frames = line.at("per_frame");
    const size_t length = frames.at("wall_ms").length();
    row.frames.wall_ms = frames.at("wall_ms").series(length, kNone);
    row.frames.psnr = frames.at("psnr").series(length, kInfinity);
    row.frames.temporal = frames.at("temporal").series(length, kNone);
    row.frames.decoded = frames.at("decoded").series(length, kNone);
    return row;
}

} // namespace

std::optional<RunRow> parseRunLine(std::string_view line, const std::string& where, std::string& other)
{
    Json json;
    try {
        json = Json::parse(line);
    } catch (const Json::exception& error) {
        throw Error(ErrorCode::InvalidFile, where + ": is not JSON (" + error.what() +
                                                "), expected one object per line as gsc-play bench --sweep writes "
                                                "them; remove the line or run it again");
    }
    const Field field(json, "", where);
    const std::string schema = field.at("schema").text();
    if (schema == "gsc.run/1")
        return readRow(field);
    if (schema.starts_with("gsc.run/"))
        throw Error(ErrorCode::Unsupported,
                    where + ": schema is " + schema + ", expected gsc.run/1; use the gsc of the program that wrote it");
    if (!schema.starts_with("gsc."))
        field.at("schema").fail("gsc.run/1");
    other = schema;
    return std::nullopt;
}

} // namespace gsc

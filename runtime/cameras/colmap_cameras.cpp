// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/colmap_cameras.h"

#include "format/numbers/count_text.h"
#include <gsc/error.h>
#include <gsc/file/read_file.h>
#include "runtime/cameras/colmap_model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

namespace gsc {

namespace {

// limit of a file's size; images.bin also lists the points of every image
constexpr uint64_t kMaxModelBytes = uint64_t(8) << 30;
constexpr std::string_view kBlank = " \t\r\v\f";
// a line that begins with as many words of x, y, point is a line of points; the rest is not looked at
constexpr size_t kSurelyPoints = 60;
constexpr double kSquareError = 0.02; // largest difference between a quaternion's squared length and 1

// Reads little-endian values from bytes, one after the other.
class Bytes {
public:
    Bytes(std::string_view data, const ColmapModel& model) : m_data(data), m_model(model) {}

    template <typename T>
    T take()
    {
        T value{};
        std::memcpy(&value, need(sizeof(T)), sizeof(T));
        return value;
    }
    std::string takeName()
    {
        const size_t end = m_data.find('\0');
        if (end == std::string_view::npos)
            m_model.fail("a name without end", "a zero behind it");
        std::string name(m_data.substr(0, end));
        m_data.remove_prefix(end + 1);
        return name;
    }
    // Skips `count` records of `each` bytes.
    void skip(uint64_t count, size_t each)
    {
        if (count > m_data.size() / each)
            m_model.fail(formatCount(count, "point") + " of an image in " + formatCount(m_data.size(), "byte"),
                         "as many as the file holds");
        (void)need(size_t(count) * each);
    }

    void warnOfRest(const char* file) const
    {
        if (!m_data.empty())
            m_model.how().warn(formatString("%s: the rest of %s behind its last record, %s, is not read",
                                            m_model.name().c_str(), file, formatCount(m_data.size(), "byte").c_str()));
    }

private:
    const char* need(size_t bytes)
    {
        if (bytes > m_data.size())
            m_model.fail("the end of the file too early", "whole records");
        const char* const at = m_data.data();
        m_data.remove_prefix(bytes);
        return at;
    }

    std::string_view m_data;
    const ColmapModel& m_model;
};

void parseColmapBinary(std::string_view cameras, std::string_view images, ColmapModel& model)
{
    Bytes lenses(cameras, model);
    for (auto count = lenses.take<uint64_t>(); count > 0; --count) {
        const auto id = lenses.take<int32_t>(), number = lenses.take<int32_t>();
        if (number < 0)
            model.fail(formatString("camera %d of model %d", id, number),
                       formatString("a model from 0 to %zu", lensModels().size() - 1));
        // the number of values of an unknown lens model is not known, so the file cannot be read beyond it
        if (size_t(number) >= lensModels().size())
            model.refuseUnknown(formatString("camera %d", id), std::to_string(number));
        ColmapLens lens;
        lens.model = &lensModels()[size_t(number)];
        lens.width = double(lenses.take<uint64_t>());
        lens.height = double(lenses.take<uint64_t>());
        for (size_t i = 0; i < lens.model->values; ++i)
            lens.values[i] = lenses.take<double>();
        model.addLens(id, lens);
    }
    lenses.warnOfRest("cameras.bin");
    Bytes poses(images, model);
    for (auto count = poses.take<uint64_t>(); count > 0; --count) {
        ColmapPose pose{};
        pose.image = poses.take<uint32_t>();
        for (double& q : pose.rotation)
            q = poses.take<double>();
        for (double& t : pose.translation)
            t = poses.take<double>();
        pose.camera = int32_t(poses.take<uint32_t>());
        pose.name = poses.takeName();
        poses.skip(poses.take<uint64_t>(), 24);
        model.addPose(pose);
    }
    poses.warnOfRest("images.bin");
}

// The functions below read cameras.txt and images.txt, as COLMAP and other programs write them.

std::string_view trimmed(std::string_view text)
{
    const size_t first = text.find_first_not_of(kBlank);
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// Splits a text into lines that end in LF, CR LF or CR; a byte order mark at the start is skipped. Several CR before
// an LF are one end of line: some programs turn CR LF into CR CR LF.
class TextLines {
public:
    explicit TextLines(std::string_view text) : m_rest(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text) {}

    bool next(std::string_view& line)
    {
        if (m_rest.empty())
            return false;
        const size_t end = std::min(m_rest.find_first_of("\r\n"), m_rest.size());
        line = trimmed(m_rest.substr(0, end));
        const size_t behind = m_rest.find_first_not_of('\r', end);
        const bool is_lf = behind != std::string_view::npos && m_rest[behind] == '\n';
        m_rest.remove_prefix(std::min(is_lf ? behind + 1 : end + 1, m_rest.size()));
        return true;
    }

private:
    std::string_view m_rest;
};

// Removes the first word from `line` and returns it; empty if there is none.
std::string_view takeWord(std::string_view& line)
{
    const size_t end = std::min(line.find_first_of(kBlank), line.size());
    const std::string_view word = line.substr(0, end);
    line = trimmed(line.substr(end));
    return word;
}

bool isNumber(std::string_view word, double& value)
{
    const char* const first = word.data() + (word.starts_with('+') ? 1 : 0);
    const auto [end, fault] = std::from_chars(first, word.data() + word.size(), value);
    return !word.empty() && fault == std::errc() && end == word.data() + word.size();
}

bool isWhole(std::string_view word, int64_t& value)
{
    const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
    return !word.empty() && fault == std::errc() && end == word.data() + word.size();
}

std::string start(std::string_view line)
{
    return "\"" + std::string(line.substr(0, 40)) + "\"";
}

// Returns N of a comment "# Number of images: N, ..." if `of` is "images"; none if the comment is not of this form.
std::optional<uint64_t> statedCount(std::string_view comment, std::string_view of)
{
    const std::string label = "Number of " + std::string(of) + ":";
    size_t at = comment.find(label);
    if (at == std::string_view::npos)
        return std::nullopt;
    comment = trimmed(comment.substr(at + label.size()));
    uint64_t count = 0;
    if (std::from_chars(comment.data(), comment.data() + comment.size(), count).ec != std::errc())
        return std::nullopt;
    return count;
}

void parseLens(std::string_view line, ColmapModel& model)
{
    const std::string_view whole = line;
    int64_t id = 0;
    ColmapLens lens;
    const bool numbered = isWhole(takeWord(line), id);
    const std::string_view name = takeWord(line);
    const auto known = std::ranges::find_if(lensModels(), [&](const LensModel& m) { return name == m.name; });
    const std::string_view width = takeWord(line), height = takeWord(line);
    if (!numbered || !isNumber(width, lens.width) || !isNumber(height, lens.height))
        model.fail("a camera that starts with " + start(whole), "its number, model, width and height");
    if (known == lensModels().end()) {
        model.addUnknown(id, std::string(name.substr(0, 40)));
        return;
    }
    lens.model = &*known;
    size_t values = 0;
    for (double value = 0; !line.empty(); ++values) {
        if (!isNumber(takeWord(line), value))
            model.fail("a value that is no number in the camera " + start(whole), "numbers");
        if (values < lens.values.size())
            lens.values[values] = value;
    }
    if (values != known->values)
        model.fail(formatCount(values, "value") + " in the camera " + start(whole),
                   formatString("%zu for %s", known->values, known->name));
    model.addLens(id, lens);
}

// Returns true if the line consists of triples of x, y, and the number of the 3D point (-1 = none), one for each point
// of an image.
bool isPoints(std::string_view line)
{
    size_t words = 0;
    double value = 0;
    for (; !line.empty() && words < kSurelyPoints; ++words)
        if (!isNumber(takeWord(line), value) || (words % 3 == 2 && (value < -1 || value != std::floor(value))))
            return false;
    return words % 3 == 0;
}

// Returns true if `line` may describe an image, even one without a name: a unit quaternion and the number of a camera
// that exists stand where they must.
bool mayBeImage(std::string_view line, const ColmapModel& model)
{
    int64_t number = 0;
    double value = 0, squares = 0;
    bool good = isWhole(takeWord(line), number);
    for (size_t i = 0; i < 7 && good; ++i) {
        good = isNumber(takeWord(line), value);
        squares += i < 4 ? value * value : 0;
    }
    return good && isWhole(takeWord(line), number) && model.hasLens(number) && std::abs(squares - 1) < kSquareError;
}

void parseImage(std::string_view line, ColmapModel& model)
{
    const std::string_view whole = line;
    ColmapPose pose{};
    bool good = isWhole(takeWord(line), pose.image);
    for (double& q : pose.rotation)
        good = isNumber(takeWord(line), q) && good;
    for (double& t : pose.translation)
        good = isNumber(takeWord(line), t) && good;
    good = isWhole(takeWord(line), pose.camera) && good;
    if (!good || line.empty())
        model.fail("an image that starts with " + start(whole), "its number, quaternion, translation, camera and name");
    pose.name = line;
    model.addPose(pose);
}

// note: COLMAP takes every second line for points, whatever it holds; other programs leave out the lines of points, of
// all images or of some
void parseImages(std::string_view text, ColmapModel& model)
{
    TextLines lines(text);
    std::optional<uint64_t> stated;
    size_t images = 0, without = 0, points = 0;
    bool after_image = false;
    std::string first;
    for (std::string_view line; lines.next(line);) {
        if (line.starts_with('#')) {
            stated = stated ? stated : statedCount(line, "images");
            continue;
        }
        const bool is_points = after_image && !line.empty() && isPoints(line);
        if (is_points && mayBeImage(line, model))
            model.fail("a line that may be points or an image without a name, or called by numbers: " + start(line),
                       "a name with a letter in it, and a line of points, if only an empty one, behind each image");
        if (line.empty() || is_points) {
            points += after_image;
            after_image = false;
            continue;
        }
        if (after_image && without++ == 0)
            first = start(line);
        parseImage(line, model);
        after_image = true;
        ++images;
    }
    if (without > 0 && points > 0)
        model.how().warn(formatString(
            "%s: images.txt has %s and no line of points, not even an empty one, behind "
            "%s of them (the line behind the first starts with %s); each is taken as an image",
            model.name().c_str(), formatCount(images, "image").c_str(), formatCount(without).c_str(), first.c_str()));
    if (stated)
        model.checkCount("images.txt", *stated, true);
}

void parseColmapText(std::string_view cameras, std::string_view images, ColmapModel& model)
{
    TextLines lines(cameras);
    std::optional<uint64_t> stated;
    for (std::string_view line; lines.next(line);) {
        if (line.starts_with('#'))
            stated = stated ? stated : statedCount(line, "cameras");
        else if (!line.empty())
            parseLens(line, model);
    }
    if (stated)
        model.checkCount("cameras.txt", *stated, false);
    parseImages(images, model);
}

std::vector<Camera> readForm(const CameraFiles& files, bool binary, const CameraReading& how)
{
    const auto read = [&](const char* file) {
        return readInputText((files.folder / (file + std::string(binary ? ".bin" : ".txt"))).string(), kMaxModelBytes,
                             "a file of a COLMAP model");
    };
    return parseColmapCameras(read("cameras"), read("images"), binary, files.name, how);
}

// Returns true if the cameras are equal to within the digits that a text file may have.
bool sameCameras(const std::vector<Camera>& a, const std::vector<Camera>& b)
{
    const auto near = [](double x, double y) { return std::abs(x - y) <= 1e-4 * std::max(1.0, std::abs(x)); };
    return std::ranges::equal(a, b, [&](const Camera& x, const Camera& y) {
        return x.name == y.name && x.width == y.width && x.height == y.height && near(x.fov_x, y.fov_x) &&
               near(x.fov_y, y.fov_y) && near(x.tan_mid_x, y.tan_mid_x) && near(x.tan_mid_y, y.tan_mid_y) &&
               std::ranges::equal(x.rotation, y.rotation, near) &&
               std::ranges::equal(x.translation, y.translation, near);
    });
}

// Warns if the text files of a model differ from the binary ones: one form may be older than the other.
void compareForms(const CameraFiles& files, const std::vector<Camera>& binary, const CameraReading& how)
{
    CameraReading quiet = how;
    quiet.warnings = nullptr;
    std::string what = "differ from";
    try {
        if (sameCameras(binary, readForm(files, false, quiet)))
            return;
    } catch (const Error&) {
        what = "cannot be read beside";
    }
    how.warn(
        formatString("%s: cameras.txt and images.txt %s cameras.bin and images.bin; the binary files are taken, pass "
                     "the path of images.txt for the others",
                     files.name.c_str(), what.c_str()));
}

} // namespace

std::vector<Camera> readColmapCameras(const CameraFiles& files, const CameraReading& how)
{
    const bool both = files.form == CameraForm::ModelInBoth;
    const std::vector<Camera> cameras = readForm(files, both || files.form == CameraForm::ModelInBinary, how);
    if (both)
        compareForms(files, cameras, how);
    return cameras;
}

std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, const CameraReading& how)
{
    ColmapModel model(name, how);
    (binary ? parseColmapBinary : parseColmapText)(cameras, images, model);
    return model.finish();
}

} // namespace gsc

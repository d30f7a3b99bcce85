// SPDX-License-Identifier: Apache-2.0
#include "player/xr/place_file.h"

#include <gsc/file/output_file.h>
#include <gsc/file/read_file.h>
#include "runtime/cameras/json_fields.h"

#include <filesystem>

namespace gsc {

namespace {

constexpr const char* kSchema = "gsc.place/1";
constexpr const char* kWhat = "the place of a headset";
constexpr uint64_t kMostBytes = 1 << 16;
constexpr const char* kAxes[] = {"right", "up", "backward"};

OrderedJson vectorJson(const glm::dvec3& v)
{
    return {v.x, v.y, v.z};
}

} // namespace

std::string placePath(const std::string& model)
{
    return model.substr(0, model.find_last_not_of('/') + 1) + ".place.json"; // beside a folder, not in it
}

OrderedJson placeJson(const Placement& place)
{
    OrderedJson json = {{"position", vectorJson(place.origin())}};
    for (int i = 0; i < 3; ++i)
        json[kAxes[i]] = vectorJson(place.axes()[i]);
    json["scale"] = place.scale();
    return json;
}

std::optional<Placement> readPlace(const std::string& model)
{
    const std::string path = placePath(model);
    if (!std::filesystem::exists(path))
        return std::nullopt;
    const ParsedJson parsed = parseJson(readInputText(path, kMostBytes, kWhat), path, kWhat);
    const JsonObject object(parsed, path);
    object.checkKeys({"schema", "position", "right", "up", "backward", "scale"});
    if (object.text("schema") != kSchema)
        throw Error(ErrorCode::InvalidFile, path, formatString("schema is \"%s\"", object.text("schema").c_str()),
                    formatString("\"%s\"", kSchema), "delete the file to start without it");
    double v[3];
    object.vector3("position", v);
    const glm::dvec3 origin(v[0], v[1], v[2]);
    glm::dmat3 axes;
    for (int i = 0; i < 3; ++i) {
        object.vector3(kAxes[i], v);
        axes[i] = {v[0], v[1], v[2]};
    }
    if (!Placement::isPlace(origin, axes))
        throw Error(ErrorCode::InvalidFile, path, "right, up and backward are no rotation",
                    "three unit vectors at right angles", "delete the file to start without it");
    return Placement(origin, axes, object.positive("scale"));
}

std::string writePlace(const std::string& model, const Placement& place)
{
    OrderedJson json = {{"schema", kSchema}};
    json.update(placeJson(place));
    const std::string path = placePath(model);
    writeTextFile(path, jsonText(json) + "\n", true);
    return path;
}

} // namespace gsc

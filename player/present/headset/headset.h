// SPDX-License-Identifier: Apache-2.0
// Brings finished pictures to a headset through OpenXR and Vulkan: the module gsc_headset, loaded when it is first
// used, so that the player starts where there is no OpenXR. All calls but locate() come from one thread, which owns
// the session and its queue. Poses are in the headset's space; times are nanoseconds of the runtime's own clock.
#pragma once

#include <gsc/frame_target.h>
#include "player/present/presenter.h"
#include "player/poses/placement.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

struct HeadsetFacts;

struct HeadsetOptions {
    std::optional<DeviceUuid> device; // GPU that draws the pictures; none = any
    double scale = 1;                 // factor on the recommended width and height of pictures
    // true: the space is OpenXR's STAGE, whose floor is at height 0; false: LOCAL, whose eyes are at height 0
    bool stage = false;
    bool depth = false;            // submit depths with the pictures, if the runtime takes them
    HeadsetFacts* known = nullptr; // where open() puts the facts found so far before it throws; null: nowhere
};

struct HeadsetView {
    uint32_t width = 0, height = 0; // size of a view's picture, pixels
    std::optional<double> hidden;   // share of pixels that the lens hides, 0 to 1; the player computes it
    uint32_t recommended_width = 0, recommended_height = 0;
    uint32_t most_width = 0, most_height = 0;
};

struct HeadsetFacts {
    // names for reports; those of the loaders and the runtime include the version. Without a runtime that answers, `gpu`
    // is the one that Vulkan finds.
    std::string loader, vulkan, runtime, headset, gpu;
    bool draws = false; // the headset's GPU is HeadsetOptions::device and shares memory with the program that draws
    std::string configuration; // kind of views: "stereo", "mono" or "quad"
    std::vector<HeadsetView> views;
    std::vector<std::string> formats;        // formats of pictures that the runtime takes, in the runtime's order
    std::string format;                      // name of the format chosen among them
    PixelFormat pixels = PixelFormat::Rgba8; // pixels that pictures must have for the format: Rgba8 or Bgra8
    std::vector<std::string> spaces;
    std::vector<std::string> extensions;
    bool tracks_gaze = false;
    bool tells_mask = false;  // the runtime tells which part of a view the lens hides
    bool takes_depth = false; // depths are submitted with pictures: they were asked for, and the runtime takes them
};

// Triangles of a view that the lens hides. Counts and values are the runtime's and unchecked.
struct HiddenMesh {
    std::vector<std::array<float, 2>> vertices; // position of a corner in the view: right and up at depth 1
    std::vector<uint32_t> indices;
    std::string fault; // reason why the runtime's mesh is not used; empty: there is no fault
};

enum class HeadsetState : uint32_t {
    Idle,    // the runtime wants no frames now, but may later
    Running, // the runtime wants frames: call beginFrame()
    Over,    // the person or the runtime ended the session
    Lost,    // the runtime or the headset has gone
};

struct HeadsetFrame {
    int64_t display_time = 0; // time at which the frame's pictures will be displayed, ns
    int64_t period = 0;       // time from one refresh of the display to the next, ns
    bool visible = false;     // false: the runtime shows no pictures, so none need be drawn
};

// Input of one hand's controller. A button or stick that the controller lacks is 0.
struct HandInput {
    std::optional<SpacePose> grip, aim;  // poses of the hand and of the ray it points along; none: not tracked
    double grab = 0;                     // how far the grab button is pressed, 0 to 1
    double stick[2] = {};                // deflection of the stick to the right and forward, -1 to 1
    bool teleport = false, menu = false; // true while the button is held down
};

struct HeadsetInput {
    HandInput hands[2]; // left hand (index 0) and right hand (index 1)
    std::optional<SpacePose> gaze;
};

// A picture for each view, and the eye that it was drawn for.
struct HeadsetPictures {
    std::span<const ShownPicture> pictures;
    std::span<const SpaceEye> eyes;
    double metre = 1; // world units in a metre of the space, to convert the depths
};

class Headset : public SharedMemory {
public:
    [[nodiscard]] virtual const HeadsetFacts& facts() const = 0;

    // Makes the images that pictures are copied to. Call it once, before the first poll(). Throws Error: Unsupported
    // if the runtime takes no format that keeps colours unchanged; OutOfMemory.
    virtual void prepare() = 0;

    // Handles the runtime's events; begins and ends the session when the runtime asks for it.
    virtual HeadsetState poll() = 0;
    virtual bool spaceMoved() = 0; // true if the space moved since the last call: earlier poses then mean other places
    // Mesh that hides parts of a view, as the runtime stated it last. Empty if the lens hides nothing or the runtime
    // states nothing.
    [[nodiscard]] virtual const HiddenMesh& hidden(size_t view) const = 0;
    virtual bool hiddenChanged() = 0; // true if a mesh of hidden() changed since the last call
    virtual void requestExit() = 0;   // asks the runtime to end the session, as if the person had ended it

    // Time of OpenXR's clock at which eyes can be located outside of a frame; 0 if the runtime tells none.
    virtual int64_t now() = 0;

    // All functions below throw Error(Device) if the runtime or the headset has gone.

    virtual HeadsetFrame beginFrame() = 0; // waits until the runtime wants the next frame
    // Locates the eyes at a time of OpenXR's clock, one per view. Returns false, with `eyes` unchanged, if the headset
    // is not tracked. May be called from any thread.
    virtual bool locate(int64_t time, std::vector<SpaceEye>& eyes) = 0;
    virtual HeadsetInput input(int64_t time) = 0;
    // Takes new pictures: copies each to where the headset reads; every endFrame() from then on shows them. The
    // pictures' memory is read until the next take() or finish().
    virtual void take(const HeadsetPictures& pictures) = 0;
    // ends the frame; `shows`: with the pictures taken last, if there are some; else with nothing
    virtual void endFrame(bool shows) = 0;
    virtual void finish() = 0; // waits until no picture's memory is being read

    // GPU time in ms of the last copy of pictures that has ended; 0 = unknown
    [[nodiscard]] virtual double copyMs() const = 0;
};

struct HeadsetFunctions {
    // Opens the headset. Throws Error: Unsupported if a runtime, a headset, a Vulkan device or the wanted space is
    // missing, naming which; Device.
    std::unique_ptr<Headset> (*open)(const HeadsetOptions& options);
};

} // namespace gsc

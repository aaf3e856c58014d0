// Generated from rig.dbc by firmware/generate.py; do not edit.
#pragma once

#include "../parameters.h"

namespace rig {

// Default, least, greatest, live.
constexpr ParameterRule kParameterRules[] = {
    {4.0f, 0.01f, 100.0f, true},  // proportional_ml_s_kpa
    {3.0f, 0.0f, 200.0f, true},  // integral_ml_s2_kpa
    {1.0f, 0.0f, 2.0f, true},  // feed_forward
    {0.008f, 0.0f, 1.0f, true},  // deadband_kpa
    {6.0f, 0.05f, 30.0f, true},  // max_flow_ml_s
    {40.0f, 1.0f, 1000.0f, true},  // max_flow_acceleration_ml_s2
    {2.0f, 0.01f, 100.0f, true},  // setpoint_rate_kpa_s
    {60.0f, 1.0f, 64.0f, false},  // syringe_volume_ml
    {0.34994f, 0.005f, 10.0f, false},  // volume_per_step_ul
    {70.0f, 1.0f, 2000.0f, true},  // system_volume_ml
    {101.325f, 50.0f, 120.0f, true},  // ambient_pressure_kpa
    {10.0f, 0.5f, 200.0f, false},  // transducer_gain_kpa_v
    {0.5f, 0.0f, 4.0f, false},  // transducer_offset_v
    {5.0f, 1.0f, 6.0f, false},  // adc_reference_v
    {15.0f, 0.5f, 54.0f, false},  // pressure_limit_kpa
    {100.0f, 1.0f, 10000.0f, true},  // pressure_rate_limit_kpa_s
    {1.0f, 0.25f, 60.0f, true},  // communication_timeout_s
    {1.0f, 0.05f, 60.0f, true},  // hx711_timeout_s
    {3.0f, 0.1f, 64.0f, true},  // leak_volume_ml
    {0.2f, 0.05f, 60.0f, true},  // stuck_time_s
    {2.0f, 0.0f, 10.0f, false},  // zero_limit_kpa
    {2.0f, 0.05f, 10.0f, false},  // homing_flow_ml_s
};

}  // namespace rig

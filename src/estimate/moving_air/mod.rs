//! Estimation in moving air: filter error on one maneuver or a group of maneuvers, from the noise of
//! the sensors to the size of the gusts.

pub mod whiteness;
pub mod filter_minimum;
pub mod maneuver_filter;
pub mod group_member;
pub mod filter_group;
pub mod sensor_noise;
pub mod gust_size;
pub mod air_motion;
